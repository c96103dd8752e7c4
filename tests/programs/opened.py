"""Open a file with the program that it is for, and say what the program sees.

Run by the interpreter of `.venv-programs`:
``opened.py PROGRAM FILE RATE OUT``. ``OUT`` gets an array ``xy`` of shape (frame, agent, 2), NaN
where nobody was seen, and ``names`` of the agents, by each loader.
"""

import sys

import numpy as np


def by_movement(file, fps):
    """Let movement open netCDF as its viewer does: with xarray, and its own check."""
    import xarray
    from movement.validators.datasets import ValidPosesInputs

    data = xarray.open_dataset(file)
    ValidPosesInputs.validate(data)
    # What its users do first, on the data themselves.
    from movement.kinematics import compute_velocity

    assert compute_velocity(data.position).shape == data.position.shape
    assert data.attrs["fps"] == fps
    return _poses(data)


def by_movement_from_deeplabcut(file, fps):
    """Let movement open a file of DeepLabCut; of HDF5 it asks pandas and PyTables."""
    from movement.io import load_poses

    return _poses(load_poses.from_dlc_file(file, fps=fps))


def by_movement_from_sleap(file, fps):
    """Let movement open an analysis file of SLEAP."""
    from movement.io import load_poses

    return _poses(load_poses.from_sleap_file(file, fps=fps))


def by_pandas(file, _):
    """Let pandas open HDF5, as DeepLabCut itself does."""
    import pandas as pd

    table = pd.read_hdf(file)
    names = list(dict.fromkeys(table.columns.get_level_values("individuals")))
    parts = [table.xs(name, axis=1, level="individuals") for name in names]
    return np.stack([part.to_numpy()[:, :2] for part in parts], axis=1), names


def by_sleap_io(file, _):
    """Let sleap-io open an analysis file: instances of tracks in frames."""
    import sleap_io

    labels = sleap_io.load_file(str(file))
    names = [track.name for track in labels.tracks]
    n_frames = 1 + max(frame.frame_idx for frame in labels)
    xy = np.full((n_frames, len(names), 2), np.nan)
    for frame in labels:
        for instance in frame:
            xy[frame.frame_idx, names.index(instance.track.name)] = instance.numpy()[0]
    return xy, names


def by_trajectorytools(file, fps):
    """Let trajectorytools open idtracker.ai's file; it drops the first and the last frame."""
    import trajectorytools

    found = trajectorytools.Trajectories.from_idtrackerai(file, interpolate_nans=False)
    assert found.params["frame_rate"] == fps
    names = np.load(file, allow_pickle=True).item()["identities_labels"]
    xy = np.full((len(found.s) + 2, len(names), 2), np.nan)
    xy[1:-1] = found.s
    return xy, names


def _poses(data):
    return data.position.values[:, :, 0].transpose(0, 2, 1), data.individuals.values.tolist()


OPENERS = {
    "movement": by_movement,
    "movement-deeplabcut": by_movement_from_deeplabcut,
    "movement-sleap": by_movement_from_sleap,
    "pandas": by_pandas,
    "sleap-io": by_sleap_io,
    "trajectorytools": by_trajectorytools,
}

if __name__ == "__main__":
    program, file, rate, out = sys.argv[1:]
    positions, agents = OPENERS[program](file, float(rate))
    np.savez(out, xy=positions, names=agents)
