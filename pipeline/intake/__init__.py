"""From a specimen folder to checked records: ``folder`` reads specimen.toml, ``forcelog`` reads force.csv."""
