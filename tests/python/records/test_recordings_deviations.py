"""How well a recording's frames are known."""

import numpy as np
import pytest
import recorded
from scipy.interpolate import make_smoothing_spline

import energymargin as em
from energymargin.records.recordings.smoothing import unit_variances

STEP, NOISE, TURN = 1 / 33, 5e-4, np.radians(0.5)


def test_variances_are_those_of_the_spline_at_its_ends_and_amid_frames():
    """Of a linear smoother with errors of variance 1, Wahba's are its matrix's diagonal."""
    moments, scale = np.arange(40.0), 2.5
    impulses = [make_smoothing_spline(moments, one, lam=scale**4) for one in np.eye(40)]
    matrix = np.stack([spline(moments) for spline in impulses], axis=1)
    at, own = unit_variances(moments, moments, scale)
    assert own == pytest.approx(np.diag(matrix), rel=1e-6)
    assert at[:, 0] == pytest.approx(own)
    # far from the ends, the integrals of 1 / (1 + (scale w)^4), and of w^2 times that
    assert at[20] == pytest.approx([8**-0.5 / scale, 8**-0.5 / scale**3], rel=0.01)


def test_a_gap_and_an_end_are_known_less_well():
    moments = np.delete(np.arange(40.0), [20, 21, 22])
    at, _ = unit_variances(moments, np.array([0.0, 10.0, 21.0]), 2.0)
    assert (at[0] > 1.5 * at[1]).all()
    assert (at[2] > [1.5, 1.0] * at[1]).all()  # a slope is seen from both sides of the gap


def recording(folder, seed=0, **options):
    """An object at rest and an effector at 5 cm/s, seen with noise."""
    random = np.random.default_rng(seed)
    time = np.arange(120) * STEP
    columns = {"frame": np.arange(120), "time": time}
    for body, speed in (("object", 0.0), ("effector", 0.05)):
        columns[f"{body}_x"] = speed * time + random.normal(0, NOISE, 120)
        columns[f"{body}_y"] = 0.3 + random.normal(0, NOISE, 120)
        columns[f"{body}_yaw"] = random.normal(0, TURN, 120)
    path = recorded.write(folder / f"{seed}.csv", columns)
    return em.recordings.read_csv(path, **options)


def test_covariances_hold_the_errors(tmp_path):
    """Of 20 recordings whose truth is known. A straight motion has no bias, for which they leave
    room: its errors are those of a linear smoother, sqrt(3/4) and 1/2 of what is told."""
    for read, covariances, truth, share in (
        ("poses", "pose_covariances", lambda t: (0.05 * t, 0 * t + 0.3, 0 * t), 0.75**0.5),
        ("velocities", "velocity_covariances", lambda t: (0 * t + 0.05, 0 * t, 0 * t), 0.5),
    ):
        scaled = []
        for seed in range(20):
            one = recording(tmp_path, seed)
            errors = getattr(one.effector, read) - np.stack(truth(one.times), axis=1)
            deviations = np.sqrt(np.diagonal(getattr(one.effector, covariances), 0, 1, 2))
            scaled.append(errors / deviations)
        assert np.std(scaled, axis=(0, 1)) == pytest.approx(share, abs=0.1)


def test_poses_as_they_were_seen_have_the_errors_of_the_camera(tmp_path):
    one = recording(tmp_path, smooth_poses=False)
    deviations = np.sqrt(np.diagonal(one.object.pose_covariances[7]))
    assert deviations == pytest.approx((NOISE, NOISE, TURN), rel=0.2)


def test_covariances_turn_with_the_cameras_frame(tmp_path):
    plain = recording(tmp_path).effector
    turned = recording(tmp_path, origin=(1.0, 0.0, np.pi / 2)).effector
    for name in ("pose_covariances", "velocity_covariances"):
        before, after = getattr(plain, name), getattr(turned, name)
        assert after[:, 0, 0] == pytest.approx(before[:, 1, 1])
        assert after[:, 2, 2] == pytest.approx(before[:, 2, 2])


def test_a_belief_about_a_frame_has_the_covariances_of_both_bodies(tmp_path):
    one = recording(tmp_path)
    known = one.uncertainty(60, effector="hand")
    assert set(known.pose) == set(known.velocity) == {"object", "hand"}
    pose, velocity = known.pose["hand"], known.velocity["object"]
    assert pose[np.ix_([0, 1, 5], [0, 1, 5])].tolist() == one.effector.pose_covariances[60].tolist()
    assert velocity[5, 5] == one.object.velocity_covariances[60, 2, 2]
    assert not pose[2:5].any()


def test_a_frame_that_is_not_there_and_errors_that_nothing_tells_are_refused(tmp_path):
    one = recording(tmp_path)
    with pytest.raises(ValueError, match="frame is 120, expected a whole number from 0 to 119"):
        one.uncertainty(120)
    measured = em.recordings.Recording(
        one.name,
        one.frames,
        one.times,
        {"object": em.recordings.Motion(one.object.poses, one.object.velocities)},
        one.repairs,
    )
    with pytest.raises(ValueError, match="velocities of 'object', whose errors nothing tells"):
        measured.uncertainty(0)
