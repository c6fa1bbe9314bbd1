"""The command ``cablebend``: results on stdout, progress and complaints on stderr.

Exit codes: 0 all measured; 1 finished, but a specimen failed; 2 usage or configuration; 3 nothing could be measured;
130 interrupted (what was finished is kept; the same command resumes).
"""

from __future__ import annotations

from pipeline.cli.group import main

__all__ = ["main"]
