"""`zfcal drive`: a robot that swims by the model."""

from __future__ import annotations

from pathlib import Path

import click

from .durations import seconds
from .options import EXISTING, NAME, PLACE, FiniteRange, speaks
from .output import Output

_LETTERS = tuple("ABCDEFGHIJ")
_DRIVING = {
    "port",
    "model",
    "pattern",
    "free_running",
    "robot",
    "radius_mm",
    "clock",
    "events",
    "dry_run",
    "force",
}


@click.command("drive")
@click.argument("trial", type=PLACE, required=False)
@click.option(
    "--port", type=NAME, metavar="DEV|virtual", help="Serial port of the robot, or a virtual one."
)
@click.option("--model", type=EXISTING, help="This model drives, whatever others the trial gets.")
@click.option(
    "--pattern",
    type=click.Choice(["fish", "pid"]),
    default="fish",
    show_default=True,
    help="Burst and coast, or the published controller alone.",
)
@click.option("--free-running", is_flag=True, help="The model's agent runs; the robot chases it.")
@click.option(
    "--robot", type=click.Choice(_LETTERS), default="F", show_default=True, help="Its letter."
)
@click.option(
    "--radius-mm",
    type=FiniteRange(min=0),
    default=15.0,
    show_default=True,
    help="Targets keep so far from the walls.",
)
@click.option(
    "--clock",
    type=click.Choice(["wall", "poses"]),
    default="wall",
    show_default=True,
    help="Tick by this computer's clock, or by the times of the poses.",
)
@click.option(
    "--duration",
    "duration_s",
    type=seconds,
    metavar="TIME",
    help="End after so long; a drive counts from its first pose.",
)
@click.option(
    "--publish",
    metavar="cats2://HOST[:PORT]",
    help="Send the parameters to a rig of the older software, which drives by itself.",
)
@click.option(
    "--publish-zones",
    metavar="ZONE,...",
    help="For each zone of that rig one of the trial's.  [default: the trial's, in order]",
)
@click.option(
    "--events", is_flag=True, help="Write a line of JSON for all that happens, in place of paths."
)
@click.option("--replay", is_flag=True, help="Compute again what the log says, and compare.")
@click.option(
    "-n",
    "--dry-run",
    is_flag=True,
    help="Say what would be opened and sent; open and write nothing.",
)
@click.option("--force", is_flag=True, help="Remove what an earlier drive left.")
@click.option(
    "--stop",
    is_flag=True,
    help="Send STOP to --port and nothing else, at once; needs no trial.",
)
@click.option(
    "--resync",
    is_flag=True,
    help="With --stop, for a robot that does not obey: also what brings its receiver back.",
)
@speaks
def command(
    out: Output,
    trial: Path | None,
    *,
    port: str | None,
    model: Path | None,
    pattern: str,
    free_running: bool,
    robot: str,
    radius_mm: float,
    clock: str,
    duration_s: float | None,
    publish: str | None,
    publish_zones: str | None,
    events: bool,
    replay: bool,
    dry_run: bool,
    force: bool,
    stop: bool,
    resync: bool,
) -> None:
    r"""Drive the robot by the newest model while the poses grow.

    Each step of the model sets a target. The wheels get a command ten times a second.
    All that decides is logged in drive/. The robot is stopped when it is not seen for half
    a second, when the port or its supply has gone, and at the end, whatever ends it.

    \b
    Example:
        zfcal drive trial --port /dev/rfcomm5
        zfcal drive trial --port virtual --pattern pid --duration 30min
        zfcal drive trial --port virtual --model trial/models/extended.toml
        zfcal drive trial --port virtual --dry-run
        zfcal drive trial --port virtual --events
        zfcal drive trial --publish cats2://rig
        zfcal drive trial --replay
        zfcal drive --stop --port /dev/rfcomm5
    """
    if stop:
        _stop(out, port, resync=resync)
        return
    if resync:
        raise click.UsageError("--resync is for --stop: a drive sends it without the option.")
    if trial is None:
        raise click.UsageError("Missing argument 'TRIAL'.")
    if replay:
        _replay(out, trial)
        return
    if publish is not None:
        _publish(out, trial, publish, zones=publish_zones, duration_s=duration_s)
        return
    if publish_zones is not None:
        raise click.UsageError("--publish-zones is for --publish.")
    from zfcal.drive.drive import drive
    from zfcal.drive.options import DriveOptions
    from zfcal.drive.pilot import Manner
    from zfcal.stages.trial_context import Task

    from .driving import DriveVoice

    if port is None:
        raise click.UsageError("Missing option '--port': a serial port, or virtual.")
    if events and out.as_json:
        raise click.UsageError(
            "--events or --json: lines while it drives, or a document at the end."
        )
    if events and dry_run:
        raise click.UsageError("--events or --dry-run: a dry run has no events.")
    manner = Manner(
        pattern=pattern, free_running=free_running, letter=robot, radius_m=radius_mm / 1000
    )
    options = DriveOptions(
        port=port,
        manner=manner,
        clock=clock,
        duration_s=duration_s,
        verbose=out.verbose > 0,
        model=model,
    )

    task = Task(dry_run=dry_run, force=force)
    if dry_run:
        out.attempt(lambda: drive(trial, options, DriveVoice(out, events=False).say, task=task))
        return

    def work() -> None:
        with DriveVoice(out, events=events) as voice:
            voice.because = drive(trial, options, voice.hear, task=task)

    out.attempt(work)


def _stop(out: Output, port: str | None, *, resync: bool) -> None:
    """Stop the robot at a port, whoever drives it; nothing heavy is loaded for that."""
    from zfcal.robot.stopping import stop_at

    idle = (_DRIVING - {"port"}) | {"duration_s", "publish", "publish_zones", "replay"}
    _refuse(idle, "--stop: it sends STOP and nothing else.")
    if port is None:
        raise click.UsageError("Missing option '--port': the serial port to stop.")
    if port == "virtual":
        raise click.UsageError("--stop is for a robot that is there: give its serial port.")

    def work() -> None:
        is_held = stop_at(port, out.note, resync=resync)
        out.note(f"{port}: STOP was sent.")
        if is_held:
            out.note(
                "Another process has the port: a drive goes on at its next tick. "
                "End it with Ctrl-C, and send STOP again."
            )
        out.result({"port": port, "sent": "STOP", "is_held_by_another": is_held})

    out.attempt(work)


def _publish(
    out: Output, trial: Path, address: str, *, zones: str | None, duration_s: float | None
) -> None:
    """Send models to a rig; nothing is driven from here."""
    from zfcal.drive.publish import PublishOptions, publish

    _refuse(_DRIVING, "--publish: the rig drives its robot itself.")
    chosen = tuple(zone.strip() for zone in zones.split(",")) if zones else ()
    options = PublishOptions(address=address, zones=chosen, duration_s=duration_s)
    out.attempt(lambda: publish(trial, options, out.tell))


def _replay(out: Output, trial: Path) -> None:
    """Work the log out anew; of all options only those of talking can take effect."""
    from zfcal.drive.replay import replay

    idle = {*_DRIVING, "duration_s", "publish", "publish_zones"}
    _refuse(idle, "--replay: the log says.")
    out.attempt(lambda: replay(trial, out.tell))


def _refuse(idle: set[str], why: str) -> None:
    """Refuse options that cannot take effect."""
    context = click.get_current_context()
    for name in sorted(idle):
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            option = next(each for each in context.command.params if each.name == name)
            raise click.UsageError(f"{option.opts[-1]} cannot be given with {why}")
