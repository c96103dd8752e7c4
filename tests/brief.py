"""zfcal as a process whose rounds take a moment: ``python brief.py COMMAND ...``.

What no option shortens is shorter here: fewer of the best are confirmed, and shorter, and the
ceiling has fewer windows. All else is the command as people have it, its processes included.
"""

import sys
from importlib.machinery import PathFinder

LESS = {"n_confirmed": 2, "long_runs": 1, "long_s": 20.0, "n_windows": 4}
"""Defaults of `zfcal.calibrate.task.Settings`."""

_WHERE = "zfcal.calibrate.task"


class Briefly:
    """Puts the defaults in when somebody asks for the module, so that nobody else waits for it."""

    @staticmethod
    def find_spec(name, path=None, target=None):
        """Return the module's own spec, with a loader that changes what it has loaded."""
        if name != _WHERE:
            return None
        spec = PathFinder.find_spec(name, path, target)
        load = spec.loader.exec_module

        def change(module):
            load(module)
            module.Settings.__init__.__kwdefaults__.update(LESS)

        spec.loader.exec_module = change
        return spec


# Processes that a command starts take this file for their main module as well.
if __name__ in {"__main__", "__mp_main__"}:
    sys.meta_path.insert(0, Briefly)

if __name__ == "__main__":
    from zfcal_cli.main import main

    main()
