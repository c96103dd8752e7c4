"""Let sleap-io write what zfcal is to read; run by the interpreter of `.venv-programs`.

``written.py FOLDER`` writes the files that are called as the functions below.
``written.py FOLDER EXPORTED`` has sleap-io turn an analysis file into labels, ``again.slp``.
"""

import sys
from pathlib import Path

import h5py
import numpy as np
import sleap_io as sio
from sleap_io import Instance, LabeledFrame, Labels, PredictedInstance, Skeleton, Track, Video

SKELETON = Skeleton(["head", "tail"], name="fish")
VIDEO = Video("tank.mp4", open_backend=False)
FISH, ROBOT = Track("fish_0"), Track("robot_3")
FRAMES = (2, 3, 4, 9)


def predicted(frame, track, shift_px=0.0):
    """Return an instance whose head is at (100 + frame, 200) px, 50 px lower for the robot."""
    y = 250.0 if track is ROBOT else 200.0
    head, tail = [100.0 + frame + shift_px, y], [90.0 + frame + shift_px, y]
    points = np.column_stack([[head, tail], [0.9, 0.8]])
    return PredictedInstance.from_numpy(points, skeleton=SKELETON, track=track, score=0.7)


def by_hand(frame, track, shift_px):
    """Return the same, set by a person, who saw no tail."""
    points = predicted(frame, track, shift_px).numpy()
    points[1] = np.nan
    return Instance.from_numpy(points, skeleton=SKELETON, track=track)


def labels(*frames, video=VIDEO):
    """Return labels of (number, instances)."""
    found = [LabeledFrame(video=video, frame_idx=k, instances=list(some)) for k, some in frames]
    return Labels(found)


def tank():
    """Two tracks, robot lost in frame 4; in 3 a person moved the fish, and somebody is unknown."""
    frames = {k: [predicted(k, FISH), predicted(k, ROBOT)] for k in FRAMES}
    frames[3] += [by_hand(3, FISH, 5.0), predicted(3, None, 40.0)]
    frames[4].pop()
    return labels(*frames.items())


def alone():
    """One animal without a track; in frame 3 a person corrected it."""
    frames = {k: [predicted(k, None)] for k in FRAMES}
    frames[3].append(by_hand(3, None, 5.0))
    return labels(*frames.items())


def crowd():
    """Two animals, and no track tells who is who."""
    return labels((2, [predicted(2, None)]), (3, [predicted(3, None), predicted(3, None, 9.0)]))


def twice():
    """A track that is two animals."""
    return labels((2, [predicted(2, FISH), predicted(2, FISH, 9.0)]))


def videos():
    """Labels of two videos."""
    other = Video("other.mp4", open_backend=False)
    frames = labels((2, [predicted(2, FISH)])), labels((2, [predicted(2, FISH)]), video=other)
    return Labels([frame for some in frames for frame in some.labeled_frames])


def _video(name, rate):
    return Video(name, open_backend=False, backend_metadata={"fps": rate})


def rates():
    """The animals are in a video of 5 Hz, and nobody in one of 30 Hz."""
    own = _video("own.mp4", 5.0)
    found = labels((2, [predicted(2, FISH)]), (3, [predicted(3, FISH)]), video=own)
    return Labels(found.labeled_frames, videos=[_video("other.mp4", 30.0), own])


def other():
    """The other way round: the one without animals has the rate of the trial."""
    own = _video("own.mp4", 30.0)
    found = labels((2, [predicted(2, FISH)]), video=own)
    return Labels(found.labeled_frames, videos=[_video("other.mp4", 5.0), own])


def words():
    """A rate that is stored as text."""
    return labels((2, [predicted(2, FISH)]), video=_video("tank.mp4", "5"))


def corrected():
    """One animal without a track, and a person's correction of the prediction."""
    found = alone()
    (frame,) = [frame for frame in found.labeled_frames if frame.frame_idx == 3]
    prediction, person = frame.instances
    person.from_predicted = prediction
    return found


def namesakes():
    """Two tracks of one name."""
    return labels((2, [predicted(2, FISH), predicted(2, Track("fish_0"), 9.0)]))


def empty():
    """Frames in which nobody is."""
    return labels((2, []))


def lost():
    """Instances of which no part was seen."""
    unseen = predicted(2, FISH)
    unseen.points["visible"] = False
    unseen.points["xy"] = np.nan
    return labels((2, [unseen]))


def move_points(path, *, linked):
    """Move the predicted points into another file, and leave a way to them."""
    with h5py.File(path, "a") as file:
        points = file["pred_points"][()]
        del file["pred_points"]
        if linked:
            with h5py.File(path.with_name("points.h5"), "w") as other:
                other["pred_points"] = points
            file["pred_points"] = h5py.ExternalLink("points.h5", "/pred_points")
        else:
            away = [(str(path.with_name("points.bin")), 0, h5py.h5f.UNLIMITED)]
            made = file.create_dataset("pred_points", points.shape, points.dtype, external=away)
            made[...] = points


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    if sys.argv[2:]:
        sio.load_file(sys.argv[2]).save(str(folder / "again.slp"))
    else:
        writers = (tank, alone, crowd, twice, videos, empty, lost)
        for write in (*writers, rates, other, words, corrected, namesakes):
            write().save(str(folder / f"{write.__name__}.slp"))
        (folder / "CAPITALS.SLP").write_bytes((folder / "tank.slp").read_bytes())
        whole = (folder / "tank.slp").read_bytes()
        (folder / "cut.slp").write_bytes(whole[: len(whole) // 2])
        for name in ("linked", "external"):
            (folder / f"{name}.slp").write_bytes((folder / "tank.slp").read_bytes())
            move_points(folder / f"{name}.slp", linked=name == "linked")
        (folder / "text.slp").write_text("frame,x,y\n")
        seen = labels(*((k, [predicted(k, FISH), predicted(k, ROBOT)]) for k in range(4)))
        sio.save_nwb(seen, folder / "tank.nwb", "predictions")
