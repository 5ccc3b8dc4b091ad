#!/usr/bin/env python3
"""Live runs with two GigE Vision cameras: Aravis' own without a camera, which show a rendered drive.

    gige_cameras_test.py SPARTAN FAKE_CAMERA SMALL_RUNS
    gige_cameras_test.py SPARTAN FAKE_CAMERA SMALL_RUNS --case lost_packets --seconds 600 --recording DRIVE

The control port of GigE Vision is fixed, so each camera has an address of its own on a loopback network of this process
(a network namespace, which Debian lets every user have). Without namespaces the test is skipped (77).
"""
import argparse
import csv
import fcntl
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
RATE_HZ = 10
POSES = 20  # of each part of a run, at least


def make_network():
    """The loopback device with two addresses: `lo` and `lo:1`."""
    SIOCSIFADDR, SIOCSIFFLAGS, IFF_UP_RUNNING = 0x8916, 0x8914, 0x41
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        def address(name, text):
            fcntl.ioctl(control, SIOCSIFADDR, struct.pack("16sHH4s8x", name, socket.AF_INET, 0, socket.inet_aton(text)))
        fcntl.ioctl(control, SIOCSIFFLAGS, struct.pack("16sH14x", b"lo", IFF_UP_RUNNING))
        address(b"lo:1", "127.0.0.2")


def images_of(recording):
    """The files of the left and the right camera, in KITTI's layout or of the odometry's pair of a simulation."""
    if (recording / "image_0").exists():
        return {"left": sorted((recording / "image_0").iterdir()), "right": sorted((recording / "image_1").iterdir())}
    images = recording / "images" / "narrow"
    return {side: sorted(images.glob(f"*_{side}.png")) for side in ("left", "right")}


class Cameras:
    """The fake cameras `left` and `right`."""

    def __init__(self, program, recording, lost, folder):
        self.program, self.lost = program, lost
        self.folders = {side: folder / side for side in images_of(recording)}
        for side, files in images_of(recording).items():
            self.folders[side].mkdir()
            for file in files:
                (self.folders[side] / file.name).symlink_to(file.resolve())
        self.epoch = time.monotonic_ns()
        self.processes = {}

    def start(self, side):
        interface = {"left": "lo", "right": "lo:1"}[side]
        command = [self.program, interface, side, str(self.lost), str(self.folders[side]), str(self.epoch), str(RATE_HZ)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout.readline().strip() == "ready", f"camera {side} does not start"
        self.processes[side] = process

    def stop(self, side):
        process = self.processes.pop(side, None)
        if process is not None:
            process.kill()
            process.wait()

    def __enter__(self):
        for side in self.folders:
            self.start(side)
        return self

    def __exit__(self, *_):
        for side in self.folders:
            self.stop(side)


def rig_with_drivers(spartan, recording, folder):
    """The rig of the recording with drivers, triggered by software at RATE_HZ."""
    rig = folder / "rig.yaml"
    convert = [spartan, "rig", "convert", str(recording), str(rig), "--to", "rig.yaml", "--quiet"]
    convert += [] if (recording / "image_0").exists() else ["--pair", "narrow"]
    subprocess.run(convert, check=True, stdout=subprocess.DEVNULL)
    lines, ids, in_cameras = [], iter(["left", "right"]), False
    for line in rig.read_text().splitlines():
        in_cameras = line == "cameras:" or (in_cameras and line.startswith(" "))
        lines.append(line)
        if in_cameras and line.strip().startswith("quaternion_xyzw:"):
            lines += ["    driver:", f"      source: aravis:Aravis-{next(ids)}", "      trigger: software",
                      f"      rate_hz: {RATE_HZ}"]
    rig.write_text("\n".join(lines) + "\n")
    return rig


class LiveRun:
    """A live run of both cameras; its poses, and what it says."""

    def __init__(self, arguments, folder, options=("--no-recording",)):
        self.out, self.log = folder / "run", folder / "log"
        rig = rig_with_drivers(arguments.spartan, arguments.recording, folder)
        command = [arguments.spartan, "run", f"live:{rig}", "-o", str(self.out), "--threads", "1",
                   "--publish", "-", "--set", "maps=false", "--set", "terrain.enabled=false", *options]
        self.began, self.first_pose = time.monotonic(), None
        with open(self.log, "w", encoding="utf-8") as text:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=text, text=True)

    def wait_for_poses(self, count, seconds=0):
        """Waits for so many poses, and so long."""
        end = time.monotonic() + seconds
        while count > 0 or time.monotonic() < end:
            line = self.process.stdout.readline()
            assert line, f"the run has ended:\n{self.log.read_text()}"
            is_pose = '"type":"pose"' in line.replace(" ", "")
            if is_pose and self.first_pose is None:
                self.first_pose = time.monotonic()
            count -= is_pose

    def wait_for_words(self, words):
        """Waits until the log has them; the poses go on meanwhile."""
        while words not in self.log.read_text():
            self.wait_for_poses(1)

    def end(self):
        """The summary, and what was said. Every image must be accounted for."""
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=120)
        summary = json.loads((self.out / "summary.json").read_text())
        check_accounts(summary, RATE_HZ * (self.first_pose - self.began))
        return summary, self.log.read_text()


def live_run(arguments, lost=0.0, unplugged=False):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with Cameras(arguments.fake, arguments.recording, lost, folder) as cameras:
            run = LiveRun(arguments, folder)
            run.wait_for_poses(POSES, arguments.seconds)
            if unplugged:
                cameras.stop("right")
                run.wait_for_words("no longer answers")
                run.wait_for_poses(1, arguments.gone)
                cameras.start("right")
                run.wait_for_words("answers again")
                run.wait_for_poses(POSES, arguments.seconds)
            return run.end()


def check_accounts(summary, most_before):
    """Every trigger is an image, and every image is in a frame, or is accounted for. Those that came before the run read
    its first frame, at most `most_before` of each camera, are in no frame."""
    pair = summary["live"]["cameras"][0]
    print(json.dumps({key: value for key, value in pair.items() if key != "cameras"}))
    print(json.dumps({"frames": summary["frames"], "latency_ms": summary["live"]["latency_ms"],
                      "dropped": summary["live"]["dropped"]}))
    waiting = 3  # at the end: for the other image, or to be taken
    rests = []
    for side, camera in zip(("left", "right"), pair["cameras"]):
        print(json.dumps(camera))
        delivered = camera["images"] + camera["incomplete"]
        open_triggers = camera["triggers"] + camera["untriggered"] - delivered - camera["unanswered"]
        assert 0 <= open_triggers <= 2 * RATE_HZ, f"{open_triggers} triggers of {camera['camera']} are not accounted for"
        both = sum(pair[key] for key in ("frames", "incomplete", "wrong_size", "apart", "stamps_reversed"))
        rests.append(delivered - both - pair[f"{side}_alone"])
        print(f"{rests[-1]} images of {camera['camera']} in no frame, at most {most_before:.0f} of them before the first one")
        assert 0 <= rests[-1] <= most_before + pair["not_taken"] + waiting, f"images of {camera['camera']} are lost"
    # Before the first frame, too, the cameras answer the same triggers.
    assert abs(rests[0] - rests[1]) <= pair["not_taken"] + waiting, f"images of one camera are lost: {rests}"


def case_plain(arguments):
    summary, _ = live_run(arguments)
    pair = summary["live"]["cameras"][0]
    assert pair["frames"] > POSES / 2
    odometry = summary["health"]["odometry"]
    # At two triggers the drive may show the same moment; black images would be lost in all frames.
    assert odometry["lost"] < 0.5 * summary["frames"], f"not the images of a drive: {odometry}"
    assert pair["incomplete"] == 0, "loopback loses no packets"


def case_lost_packets(arguments):
    summary, said = live_run(arguments, lost=arguments.lost)
    pair = summary["live"]["cameras"][0]
    assert sum(camera["incomplete"] for camera in pair["cameras"]) > 0, "no packet was lost"
    assert pair["frames"] > 0, said


def case_unplugged(arguments):
    summary, said = live_run(arguments, unplugged=True)
    pair = summary["live"]["cameras"][0]
    assert pair["cameras"][1]["losses"] == 1, said
    assert pair["left_alone"] > 0, "frames with the left image only"
    assert pair["frames"] > POSES, "frames with both images, before and after"


def case_exposure(arguments):
    """Images that are always too dark: settings go to the bounds of the cameras, 10 dB of gain, and none is refused."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with Cameras(arguments.fake, arguments.recording, 0, folder):
            run = LiveRun(arguments, folder, ["--set", "exposure.level_percent=90", "--set", "exposure.highlight_percent=100",
                                              "--set", "exposure.longest_us=2000"])
            run.wait_for_poses(POSES, arguments.seconds)
            summary, said = run.end()
        with open(run.out / "live" / "1" / "frames.csv", encoding="utf-8") as table:
            frames = list(csv.DictReader(table))
    print(json.dumps(summary["live"]["exposure"]), frames[-1]["exposure_us"], frames[-1]["gain"])
    assert "gain:" not in said and "exposure time:" not in said, said
    assert float(frames[-1]["exposure_us"]) == 2000, frames[-1]
    assert abs(float(frames[-1]["gain"]) - 10 ** 0.5) < 1e-3, frames[-1]
    assert summary["live"]["exposure"]["changes"] < POSES / 2, "settings are sent again and again"


CASES = {"plain": case_plain, "exposure": case_exposure, "lost_packets": case_lost_packets, "unplugged": case_unplugged}


def arguments_of(command_line):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spartan")
    parser.add_argument("fake")
    parser.add_argument("small_runs", type=pathlib.Path)
    parser.add_argument("--case", choices=CASES)
    parser.add_argument("--seconds", type=float, default=0, help="of each part of a run (default 0)")
    parser.add_argument("--lost", type=float, default=0.005, help="share of packets (default 0.005)")
    parser.add_argument("--gone", type=float, default=0, help="seconds without the camera after its loss was noticed (default 0)")
    parser.add_argument("--recording", type=pathlib.Path, help="rendered drive (default: that of the tests)")
    arguments = parser.parse_args(command_line)
    arguments.recording = arguments.recording or arguments.small_runs / "drive"
    return arguments


def main():
    if os.environ.get("SPARTAN_CAMERA_NETWORK") is None:
        own = ["unshare", "--user", "--map-root-user", "--net"]
        if subprocess.run([*own, "true"], capture_output=True, check=False).returncode != 0:
            print("skipped: no network namespaces")
            return SKIPPED
        os.environ["SPARTAN_CAMERA_NETWORK"] = "own"
        os.execvp("unshare", [*own, sys.executable, *sys.argv])
    make_network()
    arguments = arguments_of(sys.argv[1:])
    for name, case in CASES.items():
        if arguments.case in (None, name):
            print(f"--- {name}")
            case(arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main())
