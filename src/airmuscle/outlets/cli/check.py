"""`airmuscle check`: whether a record that was just measured is usable, and why not."""

import click

from ...bench.diagnosis import check_record
from ...bench.readers import ColumnMapping, RecordedTime, read_rig
from ..requests import ReadingRequest
from .delivery import deliver
from .hints import in_options
from .measurements import AnyFiles
from .options import Json
from .requested import with_requests
from .terminal import echo


@with_requests
def check(files: AnyFiles, reading: ReadingRequest, json: Json = False) -> None:
    """Check whether records are usable, right after a measurement.

    \b
    Looks at length, gaps, sample time, delay of the pressure behind its command, loss of supply,
    exchanged columns, signs, zeros, saturation, stuck sensors, spikes, end stops, and pressures
    that do not follow their commands. Each fault is named with what to do. The exit code is 1 if a
    record is not usable.

    \b
    Examples:
      airmuscle check run_07.csv
      airmuscle check today/ --mapping rig.toml
    """
    mapping = reading.column_mapping(ColumnMapping(time=RecordedTime(ordered=False)))
    rig = read_rig(files, mapping)
    for text in rig.describe_failures():
        echo(f"error: {in_options(text, 'inspect')}", err=True)
    checks = [check_record(recording) for recording in rig.recordings]
    if checks:
        chapters = [
            result.chapter() if len(checks) == 1 else result.chapter().among(suffix=f"-{i}")
            for i, result in enumerate(checks, 1)
        ]
        deliver("check", chapters, json=json, out=None, title="Check")
    if rig.failures or not all(result.is_usable for result in checks):
        raise click.exceptions.Exit(1)
