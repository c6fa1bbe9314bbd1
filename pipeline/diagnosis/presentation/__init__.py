"""A conclusion put into the part of the result that people read: `part.present`."""
