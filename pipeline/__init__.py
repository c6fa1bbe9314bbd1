"""From a folder of photos and forces to a report of the bending stiffness characteristic, room by room.

Programs of your own enter by ``import cablebend``; importing this package loads nothing.
"""

from __future__ import annotations

__version__ = "0.1.0"
