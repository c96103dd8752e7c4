"""The main job, small, on a system that has little: ``python working_day.py SAMPLE``.

It runs in the folder where one is, and prints each command with its exit code. The processes that
draw a diagnosis begin with this file, so that they have as little.
"""

import sys

from elsewhere import go_elsewhere

go_elsewhere()

DAY = """
    init day --arena two-rooms --fish 4 --robot --fps 15
    import SAMPLE day --format csv
    analyse day
    calibrate day --generations 1 --population 4 --steps 100 --seed 1
    simulate later --model day/models/000120.toml --duration 2min --seed 2
    diagnose day --quick
    extend day --effect alignment --generations 0 --population 4
    report day
    export day --to csv --to parquet --to movement --to sleap --to trex --to deeplabcut
    import day/export/csv/tracks.csv day --format csv --force
    compare day --against later -o compared
    compare day --against day
    reproduce later --generations 0 -o again
    inspect day/tracks/000060.parquet
    check day
"""

if __name__ == "__main__":
    from zfcal_cli.main import run

    for line in DAY.strip().splitlines():
        words = [sys.argv[1] if word == "SAMPLE" else word for word in line.split()]
        code = run(words)
        sys.stdout.write(f"exit code {code} {words[0]}\n")
