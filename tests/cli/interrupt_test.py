"""Ctrl-C and SIGTERM stop long work within a second, at any stage, with a message on how to resume."""

import array
import math
import os
import random
import re
import signal
import subprocess
import time
import unittest

from support import SCRIPT, SMALL_STAGE, SURFLECT, TestInFolder, succeed, write_small_capture

MOMENTS = int(os.environ.get("MOMENTS", 2))  # of each command and signal
TICKS = os.sysconf("SC_CLK_TCK")


def processor_seconds(process):
    """Processor time of a living process so far."""
    with open(f"/proc/{process.pid}/stat") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def write_ribbon(path, vertices):
    """A mesh as one strip that winds around the z axis: quick to write, slow to read."""
    turn = [(math.cos(i / 100), math.sin(i / 100)) for i in range(1000)]
    places = array.array("f", [c for i in range(vertices) for c in (*turn[i % 1000], i / vertices)])
    header = f"""ply
format binary_little_endian 1.0
element vertex {vertices}
property float x
property float y
property float z
element tristrips 1
property list int int vertex_indices
end_header
"""
    path.write_bytes(header.encode() + places.tobytes() +
                     array.array("i", [vertices, *range(vertices)]).tobytes())


def catches(process, signal_number):
    """Whether a living process has a handler for the signal."""
    with open(f"/proc/{process.pid}/status") as status:
        masks = [line.split()[1] for line in status if line.startswith("SigCgt")]
    return bool(int(masks[0], 16) >> (signal_number - 1) & 1)


def interrupt_after(seconds, signal_number, *arguments):
    """Exit code, stderr, and the processor time between the signal and the end; None if it ended before."""
    process = subprocess.Popen([SURFLECT, *map(str, arguments)], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    time.sleep(seconds)
    if process.poll() is not None:
        process.communicate()
        return None
    before = processor_seconds(process)
    os.kill(process.pid, signal_number)  # send_signal would wait for a process that has just ended
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stderr.close()
    return process.returncode, said, usage.ru_utime + usage.ru_stime - before


class TimeLeft(TestInFolder):
    def test_a_terminal_is_told_the_time_that_a_stage_will_take(self):
        stage = self.folder / "stage.toml"
        stage.write_text(SMALL_STAGE.replace("samples = 16", "samples = 4000"))
        screen, end = os.openpty()
        process = subprocess.Popen([SURFLECT, "capture", stage, "-o", self.folder / "capture"], stderr=end)
        os.close(end)
        shown = ""
        try:
            while not re.search(r"\d+ %, (\d+ h )?(\d+ min )?(\d+ s )?left", shown):
                shown += os.read(screen, 4096).decode()
        except OSError as error:  # the program has ended
            self.fail(f"{error}: {shown[-300:]!r}")
        finally:
            process.kill()
            process.wait()
            os.close(screen)


class Interrupt(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=3, lights=4, script=SCRIPT.replace("[120, 90]", "[600, 450]"))
        begin = time.monotonic()
        succeed(*cls.pack("model.srf"))
        cls.packing = time.monotonic() - begin

    @classmethod
    def pack(cls, name):
        return ["pack", cls.capture, "-o", cls.folder / name, "--surfels", "100000", "--tables", "off"]

    def stops_at_any_moment(self, duration, arguments_for, advice):
        uniform = random.Random(1).uniform
        stopped = 0
        for signal_number in (signal.SIGINT, signal.SIGTERM):
            for moment in range(MOMENTS):
                after = duration * (moment + uniform(0, 1)) / MOMENTS
                result = interrupt_after(after, signal_number, *arguments_for(f"{signal_number}-{moment}"))
                if result is None:
                    continue
                status, said, used = result
                with self.subTest(signal=signal_number, after=after):
                    if status == -signal_number:  # before main could ask for the signal
                        self.assertLess(after, 0.5)
                        continue
                    if status == 0:  # it had done its work already
                        continue
                    stopped += 1
                    self.assertEqual(status, 128 + signal_number, said)
                    self.assertEqual(said.splitlines()[-1], "surflect: interrupted; " + advice)
                    # Processor time of all threads, which does not depend on other work on the machine.
                    self.assertLess(used, 1)
        self.assertGreaterEqual(stopped, MOMENTS)

    def test_import(self):
        source = self.folder / "source"
        write_small_capture(source, cameras=8, lights=7)

        def arguments(name):
            return ["import", source, "-o", self.folder / "imported" / name, "--mask-from", "brightness:0.1"]

        begin = time.monotonic()
        succeed(*arguments("whole"))
        self.stops_at_any_moment(time.monotonic() - begin, arguments,
                                 "nothing was kept; the same command starts afresh")
        left = [path.name for path in (self.folder / "imported").iterdir() if ".tmp." in path.name]
        self.assertEqual(left, [])

    def test_capture_and_pack_in_one_pass(self):
        stage = self.folder / "stage.toml"
        stage.write_text(SMALL_STAGE.replace("[24, 24]", "[100, 100]"))

        def arguments(name):
            return ["capture", stage, "--pack", self.folder / f"{name}.srf", "--surfels", "20000"]

        begin = time.monotonic()
        succeed(*arguments("traced"))
        self.stops_at_any_moment(time.monotonic() - begin, arguments, "the same command again goes on from here")

    def test_pack(self):
        self.stops_at_any_moment(self.packing, self.pack, "the same command again keeps the views that were finished")

    def test_pack_of_a_large_mesh(self):
        ribbon = self.folder / "ribbon.ply"
        write_ribbon(ribbon, 1000000)
        self.stops_at_any_moment(1, lambda name: [*self.pack(name), "--mesh", ribbon],
                                 "the same command again keeps the views that were finished")

    def test_a_second_signal_ends_at_once(self):
        ended = 0
        for attempt in range(0, 20, 2):  # in most of which there is time for a second one before the first has its way
            process = subprocess.Popen([SURFLECT, *map(str, self.pack(f"twice-{attempt}"))],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            while process.poll() is None and not catches(process, signal.SIGINT):
                time.sleep(0.001)
            time.sleep(min(0.05, self.packing / 20) * attempt)
            process.send_signal(signal.SIGINT)
            while process.poll() is None and catches(process, signal.SIGINT):
                pass
            process.send_signal(signal.SIGINT)
            status = process.wait()
            self.assertIn(status, (0, 128 + signal.SIGINT, -signal.SIGINT))  # 0: it had done its work already
            ended += status == -signal.SIGINT
        self.assertGreater(ended, 0)

    def test_render(self):
        def arguments(name):
            return ["render", self.script, "-o", self.folder / name]

        begin = time.monotonic()
        succeed(*arguments("whole"))
        self.stops_at_any_moment(time.monotonic() - begin, arguments,
                                 "with --resume, the same command goes on from here")

    def test_render_under_a_large_environment(self):
        noise = bytearray(random.Random(1).randbytes(4 * 2800 * 1400))
        noise[3::4] = b"\x80" * (2800 * 1400)  # exponents
        (self.folder / "noise.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1400 +X 2800\n" + noise)
        script = self.folder / "outside.toml"
        script.write_text(SCRIPT.replace("last = 3", "last = 1") +
                          '[[light]]\ntype = "environment"\nimage = "noise.hdr"\n')
        begin = time.monotonic()
        succeed("render", script, "-o", self.folder / "lit")
        self.stops_at_any_moment(time.monotonic() - begin,
                                 lambda name: ["render", script, "-o", self.folder / f"lit-{name}"],
                                 "with --resume, the same command goes on from here")

    def test_inspect_with_an_overlay(self):
        def arguments(name):
            return ["inspect", self.capture, "--overlay", self.folder / f"{name}.png", "--max-frames", "3"]

        begin = time.monotonic()
        succeed(*arguments("sheet"))
        self.stops_at_any_moment(time.monotonic() - begin, arguments, "nothing was kept")

    def test_evaluate(self):
        arguments = ["evaluate", self.model, self.capture, "--baseline", "nearest"]
        begin = time.monotonic()
        succeed(*arguments)
        self.stops_at_any_moment(time.monotonic() - begin, lambda _: arguments, "nothing was kept")


if __name__ == "__main__":
    unittest.main()
