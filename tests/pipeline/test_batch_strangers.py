"""Nobody else on the machine reaches a run: none of its processes listens, whatever the address."""

import os
import signal

import psutil

from tests.pipeline.cheap_batch import PATIENCE_S, start, wait_for, write_specimens


def doors(process: psutil.Process) -> list[str]:
    """Addresses, of any kind, at which others can reach a process."""
    open_ports = [c for c in process.net_connections("inet") if c.status == psutil.CONN_LISTEN or not c.raddr]
    named = [c for c in process.net_connections("unix") if c.laddr]
    return [f"{process.pid}: {c.laddr}" for c in (*open_ports, *named)]


def test_no_process_of_a_run_listens(tmp_path):
    write_specimens(tmp_path / "batch", [f"s{n}" for n in range(8)])
    run = start(tmp_path / "batch", tmp_path / "out", HELD_BEYOND_FIVE_IN=str(tmp_path / "out"))
    try:
        wait_for(lambda: len(list((tmp_path / "out").glob("*/entry.json"))) >= 5, run)
        main = psutil.Process(run.pid)
        family = [main, *main.children(recursive=True)]
        assert sum("spawn_main" in " ".join(member.cmdline()) for member in family) >= 2
        assert [door for member in family for door in doors(member)] == []
    finally:
        os.killpg(run.pid, signal.SIGKILL)
        run.communicate(timeout=PATIENCE_S)
