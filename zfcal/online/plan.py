"""What a watch would do now, said without a process, a lock or a file."""

from __future__ import annotations

from pathlib import Path

from zfcal.online.hints import reason_to_poll
from zfcal.online.watch_stages import WatchOptions
from zfcal.stages.events import Event, Note, Planned, Tell
from zfcal.stages.trial_context import open_trial


def tell_watch_plan(root: Path, options: WatchOptions, tell: Tell) -> None:
    """Say what each stage would make from what is there now.

    What a stage would make from files that the stage before it has yet to make is not said.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What would run.
    tell
        Hears of each file.

    Raises
    ------
    ZfcalError
        The trial is wrong, or a stage cannot begin.
    """
    open_trial(root)
    jobs = options.jobs(root)
    polls = reason_to_poll(root, asked=options.poll)
    how = f", which it polls ({polls})" if polls else ""
    named = ", ".join(jobs) or "no stage"
    tell(Note(text=f"watch would run {named} in {root}{how if jobs else ''}."))
    for name, job in jobs.items():
        planned: list[Path] = []

        def hear(event: Event, planned: list[Path] = planned) -> None:
            if isinstance(event, Planned):
                planned.append(event.path)
            tell(event)

        job.plan(hear)
        now = f"{len(planned)} files to make now" if planned else "nothing to make now"
        tell(Note(text=f"{name}: {now}."))
