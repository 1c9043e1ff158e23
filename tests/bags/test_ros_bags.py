"""Bags of ROS as measurements: standstills, topics, and what is refused."""

from __future__ import annotations

import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import known
from tests.ros_bags import NAMES, STOPS, Message, joint_messages, recorded, target_messages, write_ros1, write_ros2

import truearm
from truearm.bags.standstills import Standstill, find_standstills, lost_messages, missed_pauses, seen_at
from truearm.bags.streams import JointStream, TargetStream
from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot

TIMES, JOINTS, SEEN, POSITIONS, TURNS = recorded()
OF_JOINTS = joint_messages(TIMES, JOINTS)
OF_TARGET = target_messages(SEEN, POSITIONS, TURNS)


def refused(bag: Path, words: str, **options: object) -> InputError:
    with pytest.raises(InputError, match=words) as refusal:
        truearm.import_ros(bag, **options)  # type: ignore[arg-type]
    return refusal.value


def test_five_standstills_are_five_configurations(tmp_path: Path) -> None:
    messages, out = [*OF_JOINTS, *OF_TARGET], tmp_path / "data.csv"
    places, _ = load_robot("irb120").forward(np.radians(STOPS))
    for bag in (
        write_ros1(tmp_path / "cell.bag", messages),
        write_ros2(tmp_path / "sqlite3", messages),
        write_ros2(tmp_path / "mcap", messages, mcap=True),
    ):
        data = truearm.import_ros(bag, out=out).data
        assert data.labels == ("1", "2", "3", "4", "5")
        np.testing.assert_allclose(np.degrees(data.joints), STOPS, atol=2e-4)
        np.testing.assert_allclose(data.position, places, atol=2e-5)
        np.testing.assert_allclose(known(data.sigma), 2e-5 / np.sqrt(28), rtol=0.25)
        np.testing.assert_allclose(known(data.sigma_rot), 1e-4 / np.sqrt(28), rtol=0.25)
        moved = np.sign(STOPS[1] - STOPS[0]) + (STOPS[1] == STOPS[0])
        np.testing.assert_array_equal(known(data.approach)[1], moved)
        np.testing.assert_allclose(truearm.load_data(out).position, data.position, atol=1e-12)
        assert "Standstills in a recording" in out.with_suffix(".html").read_text()


def test_deviation_of_the_mean_counts_that_samples_are_alike() -> None:
    """Of an autoregressive series with factor 0.8 a mean of n has the variance 9 / n, not 1 / n."""
    rng = np.random.default_rng(5)
    n, stops = 400, 30
    series = np.zeros((stops, n + 100, 3))
    for sample in range(1, n + 100):
        series[:, sample] = 0.8 * series[:, sample - 1] + rng.normal(0.0, 0.6e-4, (stops, 3))
    series = series[:, 100:]
    times = np.arange(stops * n, dtype=float) / 20.0
    stills = [Standstill(20.0 * i, 20.0 * i + 19.96, np.zeros(6), 0.0) for i in range(stops)]
    stream = TargetStream("tip", "/tip", times, series.reshape(-1, 3), None, "tracker", 0)
    sigmas = [sighting.sigma for sighting in seen_at(stills, stream, 0.0)]
    true = 1e-4 * np.sqrt(9.0 / n)
    assert np.mean(sigmas) == pytest.approx(true, rel=0.15)
    means = series.mean(axis=1)
    assert np.sqrt(np.mean(means**2)) == pytest.approx(true, rel=0.25)


def test_joints_are_put_in_the_robots_order(tmp_path: Path) -> None:
    shuffled = joint_messages(TIMES, JOINTS, order=[3, 0, 5, 1, 4, 2])
    numbered = truearm.import_ros(write_ros2(tmp_path / "numbered", [*shuffled, *OF_TARGET])).data
    np.testing.assert_allclose(np.degrees(numbered.joints), STOPS, atol=2e-4)
    names = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    gripper = joint_messages(TIMES[::10] + 1e-4, JOINTS[::10], names=["finger", *names[1:]], order=[0])
    alphabet = joint_messages(TIMES, JOINTS, names, order=np.argsort(names).tolist())
    bag = write_ros2(tmp_path / "alphabet", [*alphabet, *gripper, *OF_TARGET])
    assert refused(bag, "names do not tell their order").parameter == "joint_names"
    named = truearm.import_ros(bag, joint_names=names)
    np.testing.assert_allclose(np.degrees(named.data.joints), STOPS, atol=2e-4)
    assert refused(bag, "no message holds all", joint_names=[*names[:5], "tool"])
    assert refused(bag, "each joint has one name", joint_names=[]).parameter == "joint_names"
    assert refused(bag, "each joint has one name", joint_names=np.array([], dtype=str)).parameter == "joint_names"
    slides = truearm.import_ros(bag, joint_names=names, prismatic=["elbow"]).data
    assert slides.joint_kinds[2] == "prismatic"
    assert refused(bag, "no such joint", joint_names=names, prismatic=["rail"]).parameter == "prismatic"


def test_every_kind_of_target(tmp_path: Path) -> None:
    for kind in ("PointStamped", "TransformStamped", "PoseWithCovarianceStamped"):
        seen = target_messages(SEEN, POSITIONS, None if kind == "PointStamped" else TURNS, kind=kind)
        data = truearm.import_ros(write_ros1(tmp_path / f"{kind}.bag", [*OF_JOINTS, *seen])).data
        assert (data.quaternion is None) == (kind == "PointStamped")
        assert data.targets == ("tracker/pose",), kind


def test_several_targets_and_a_point_beside_the_robot(tmp_path: Path) -> None:
    beside = np.random.default_rng(1).normal(0.0, 2e-5, POSITIONS.shape) + np.eye(3)[0]
    hidden = target_messages(SEEN[SEEN < 11.0], POSITIONS[SEEN < 11.0], topic="/nest", kind="PointStamped")
    ground = target_messages(SEEN, beside, topic="/ground", kind="PointStamped")
    bag = write_ros2(tmp_path / "cell", [*OF_JOINTS, *OF_TARGET, *hidden, *ground])
    assert refused(bag, "several topics hold points or poses").parameter == "targets"
    topics = {"tool": "/tracker/pose", "nest": "/nest"}
    read = truearm.import_ros(bag, targets=topics, references={"ground": "/ground"})
    assert read.data.targets == ("tool", "nest")
    assert known(read.data.references).targets == ("ground",)
    assert "not seen in 1 standstill" in str(read.lines())
    assert read.summary()["targets"][1]["missing"] == 1
    assert "Did you mean /nest" in str(refused(bag, "no such topic", targets={"nest": "/nets"}))
    assert refused(bag, "holds something else", targets={"nest": "/joint_states"})
    assert refused(bag, "one topic has two names", targets={"a": "/nest", "b": "/nest"}).parameter == "targets"
    assert refused(bag, "a target and for a point", targets=topics, references={"tool": "/ground"})
    assert refused(bag, "and no target", references={"tool": "/ground"})


def test_outlying_samples_are_set_aside_and_told(tmp_path: Path) -> None:
    outlying = POSITIONS.copy()
    outlying[20] += [0.0, 0.4, 0.0]
    lost = outlying.copy()
    lost[10] = np.nan
    bag = write_ros2(tmp_path / "cell", [*OF_JOINTS, *target_messages(SEEN, lost, TURNS)])
    read = truearm.import_ros(bag)
    assert "1 sample set aside" in str(read.lines())
    assert "1 message without numbers" in str(read.lines())
    places, _ = load_robot("irb120").forward(np.radians(STOPS))
    np.testing.assert_allclose(read.data.position, places, atol=2e-5)
    # and of a slow camera
    times, joints, seen, positions, turns = recorded(pose_rate=7.0, stand=3.0)
    positions[[8, 12]] += [0.3, 0.0, 0.0]
    bag = write_ros2(tmp_path / "two", [*joint_messages(times, joints), *target_messages(seen, positions, turns)])
    assert "2 samples set aside" in str(truearm.import_ros(bag).lines())
    positions[[5, 7, 9]] += [0.0, 0.3, 0.0]
    bag = write_ros2(tmp_path / "five", [*joint_messages(times, joints), *target_messages(seen, positions, turns)])
    assert refused(bag, "too many samples of a standstill are outlying")


def test_pauses_that_are_no_standstills_are_said(tmp_path: Path) -> None:
    assert refused(write_ros2(tmp_path / "all", [*OF_JOINTS, *OF_TARGET]), "never stands still", shortest_dwell=2.5)
    start = 4 * 3.0
    creeping = JOINTS + np.where((TIMES > 2.95) & (TIMES < 5.05), np.radians(0.05) * (TIMES - 2.95), 0.0)[:, None]
    hidden = (TIMES < 8.5) | (start < TIMES)
    messages = joint_messages(TIMES[hidden], creeping[hidden])
    read = truearm.import_ros(write_ros2(tmp_path / "some", [*messages, *OF_TARGET]))
    assert read.data.labels == ("1", "3", "5")
    np.testing.assert_array_equal(known(read.data.approach), 0.0)
    assert "2 pauses without a standstill, at 2.9 s, 8.5 s" in str(read.lines())
    stands = np.abs(np.diff(JOINTS[:, :1], axis=0, prepend=JOINTS[:1, :1])) < 1e-4
    slow = np.radians(0.1) * np.cumsum(stands)[:, None] / 100
    crept = JOINTS + np.where(TIMES[:, None] < 10.0, slow, slow[1000])
    bag = write_ros2(tmp_path / "most", [*joint_messages(TIMES, crept), *OF_TARGET])
    assert refused(bag, "most pauses of the robot are no standstills").parameter == "shortest_dwell"


def with_lost(share: float, stand: float, rate: float = 100.0, seed: int = 3) -> JointStream:
    times, joints, *_ = recorded(stand=stand, joint_rate=rate, seed=seed)
    received = np.random.default_rng(seed).random(len(times)) >= share
    return JointStream("/joint_states", NAMES, times[received] - times[received][0], joints[received], 0)


def test_lost_messages_do_not_tear_a_standstill() -> None:
    cases = [(0.3, 6.0, 100.0), (0.6, 3.0, 100.0), (0.3, 4.0, 20.0)]
    for (share, stand, rate), seed in product(cases, range(5)):
        stream = with_lost(share, stand, rate, seed)
        stills = find_standstills(stream, 3.5e-4, 1.0)
        assert len(stills) == 5
        assert not missed_pauses(stream, stills)
        np.testing.assert_allclose([s.end - s.start for s in stills], stand, atol=0.5)
        whole = 1 + round((stream.times[-1] - stream.times[0]) * rate)
        assert lost_messages(stream) == whole - len(stream.times)


def test_times_that_are_uneven_tell_nothing_of_lost_messages() -> None:
    times, joints, *_ = recorded()
    rng = np.random.default_rng(1)
    pairs = np.sort(np.concatenate([times[::2], times[::2] + 1e-4]))
    for uneven in (np.sort(rng.uniform(0.0, 14.0, len(times))), pairs):
        stream = JointStream("/joint_states", NAMES, uneven - uneven[0], joints[: len(uneven)], 0)
        assert lost_messages(stream) == 0
    jittered = np.sort(times + rng.normal(0.0, 1e-3, len(times)))
    assert lost_messages(JointStream("/joint_states", NAMES, jittered - jittered[0], joints, 0)) < 0.01 * len(times)


def test_a_stop_that_the_arm_may_have_left_between_messages_is_two() -> None:
    """In a gap of a second the arm may have gone and come back; in one of 0.2 s nobody drives it away and back."""
    for gap, stills in ((0.2, 1), (1.0, 2)):
        times = np.concatenate([np.arange(0.0, 3.0, 0.01), np.arange(3.0 + gap, 6.0, 0.01)])
        stream = JointStream("/joint_states", NAMES, times, np.zeros((len(times), 6)), 0)
        assert len(find_standstills(stream, 3.5e-4, 1.0)) == stills
    nudged = np.zeros((len(times), 6))
    nudged[200:206, 0] = np.radians(0.5)
    assert len(find_standstills(JointStream("/joint_states", NAMES, times, nudged, 0), 3.5e-4, 0.5)) == 3


def test_missing_messages_are_told(tmp_path: Path) -> None:
    received = np.random.default_rng(0).random(len(TIMES)) >= 0.3
    read = truearm.import_ros(
        write_ros2(tmp_path / "cell", [*joint_messages(TIMES[received], JOINTS[received]), *OF_TARGET])
    )
    assert read.data.configurations == 5
    assert [(notice.code, notice.level) for notice in read.warnings] == [("messages-missing", "warning")]
    assert f"of {len(TIMES)} messages of the joints are missing" in str(read.lines())
    assert read.summary()["warnings"][0]["code"] == "messages-missing"
    # clocks that differ are told too
    for late in (0.8, -0.7, 1.6):
        _, _, seen, positions, turns = recorded(late=late)
        bag = write_ros2(tmp_path / f"{late}", [*OF_JOINTS, *target_messages(seen, positions, turns)])
        assert refused(bag, "moves while the joints stand still").parameter == "times"


def test_standstills_without_scatter_declare_no_deviation(tmp_path: Path) -> None:
    times, joints, seen, positions, turns = recorded(noise=0.0)
    bag = write_ros2(tmp_path / "cell", [*joint_messages(times, joints), *target_messages(seen, positions, turns)])
    read = truearm.import_ros(bag)
    assert read.data.sigma is None
    assert "No deviations are declared" in str(read.lines())


def test_what_holds_no_standstill(tmp_path: Path) -> None:
    bag = write_ros2(tmp_path / "cell", [*OF_JOINTS, *OF_TARGET])
    assert refused(bag, "never stands still", shortest_dwell=5.0).parameter == "still"
    slow = JOINTS[:1] + np.radians(0.015) * TIMES[:, None]
    assert refused(write_ros2(tmp_path / "slow", [*joint_messages(TIMES, slow), *OF_TARGET]), "creep")
    assert refused(bag, "nothing is left", shortest_dwell=0.5).parameter == "settle"
    assert refused(bag, "out of range", shortest_dwell=1e5).parameter == "shortest_dwell"
    assert refused(bag, "too short a time", shortest_dwell=100.0)
    few = target_messages(SEEN[::19], POSITIONS[::19], TURNS[::19])
    assert refused(write_ros2(tmp_path / "few", [*OF_JOINTS, *few]), "nothing was seen")


def test_what_is_no_bag(tmp_path: Path) -> None:
    assert refused(tmp_path / "none.bag", "there is no such bag")
    assert refused(tmp_path, "no bag of ROS 2")
    text = tmp_path / "text.csv"
    text.write_text("a")
    assert refused(text, "this is no bag")
    bag = write_ros2(tmp_path / "cell", [*OF_JOINTS, *OF_TARGET])
    assert refused(next(bag.glob("*.db3")), "a bag of ROS 2 is a folder")
    words: list[Message] = [("/words", "std_msgs/msg/String", 0.0, {})]
    assert refused(write_ros2(tmp_path / "words", [*words, *OF_TARGET]), "no joint positions")
    assert "/words (std_msgs/String)" in str(refused(write_ros2(tmp_path / "alone", [*words, *OF_JOINTS]), "no topic"))
    other = joint_messages(TIMES, JOINTS, topic="/commanded")
    two = write_ros2(tmp_path / "two", [*OF_JOINTS, *other, *OF_TARGET])
    assert refused(two, "several topics hold joint positions").parameter == "joint_topic"
    assert truearm.import_ros(two, joint_topic="/joint_states").data.configurations == 5


def test_what_messages_cannot_be(tmp_path: Path) -> None:
    unstamped = write_ros2(tmp_path / "unstamped", [*OF_JOINTS, *OF_TARGET], stamped=False)
    assert refused(unstamped, "no time in its header").parameter == "times"
    assert truearm.import_ros(unstamped, times="bag").data.configurations == 5
    frames = [*target_messages(SEEN[:50], POSITIONS[:50], TURNS[:50], frame="world"), *OF_TARGET[50:]]
    assert refused(write_ros2(tmp_path / "frames", [*OF_JOINTS, *frames]), "several frames")
    long = write_ros2(tmp_path / "long", [*OF_JOINTS, *target_messages(SEEN, POSITIONS, 1.1 * TURNS)])
    assert refused(long, "does not have length 1")
    nan = JOINTS.copy()
    nan[7, 2] = np.nan
    broken = write_ros2(tmp_path / "nan", [*joint_messages(TIMES, nan), *OF_TARGET])
    assert NAMES[2] in str(refused(broken, "is no number"))


def test_damaged_bags_are_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    whole = {
        "cell.bag": write_ros1(tmp_path / "cell.bag", [*OF_JOINTS, *OF_TARGET]),
        "sqlite": write_ros2(tmp_path / "sqlite", [*OF_JOINTS, *OF_TARGET]),
        "mcap": write_ros2(tmp_path / "mcap", [*OF_JOINTS, *OF_TARGET], mcap=True),
    }
    outcomes = set()
    for number in range(24):
        name = list(whole)[number % 3]
        copy = tmp_path / str(number) / name
        copy.parent.mkdir()
        (shutil.copytree if whole[name].is_dir() else shutil.copy)(whole[name], copy)
        damaged = copy if copy.is_file() else sorted(copy.iterdir())[number // 3 % 2]
        content = bytearray(damaged.read_bytes())
        if number % 2:
            del content[int(rng.integers(len(content))) :]
        else:
            for place in rng.integers(len(content), size=30):
                content[int(place)] = int(rng.integers(256))
        damaged.write_bytes(content)
        try:
            truearm.import_ros(copy)
            outcomes.add("read")
        except InputError:
            outcomes.add("refused")
    assert "refused" in outcomes
    bag = whole["cell.bag"]
    joint = NAMES[2].encode()
    bag.write_bytes(bag.read_bytes().replace(joint, b"\x81" + joint[1:]))
    assert refused(bag, "the bag cannot be read").came == "a text that is no UTF-8"
