"""From a folder of photos and forces to a report of the bending stiffness characteristic."""

__version__ = "0.1.0"
