"""Where the two bearing axes are: rims, dots and screws of round covers, their size, or the cable's own ends."""
