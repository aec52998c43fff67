"""`surflect pack`: its report, and that an interrupted run leaves no trace in the result."""

import itertools
import json
import signal
import subprocess
import time
import unittest

from support import SURFLECT, TestInFolder, content, run, succeed, write_small_capture


class Pack(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "capture"
        write_small_capture(cls.capture, cameras=5, lights=3)
        cls.report = cls.pack("whole.srf")
        cls.whole = content(cls.folder / "whole.srf")

    @classmethod
    def arguments(cls, name):
        return ["pack", cls.capture, "-o", cls.folder / name, "--surfels", "3000"]

    @classmethod
    def pack(cls, name, *options):
        return succeed(*cls.arguments(name), *options)

    def interrupt(self, name, moment, signal_number):
        """Starts to pack and sends the signal once the file `moment` is in the model's folder."""
        process = subprocess.Popen([SURFLECT, *map(str, self.arguments(name))],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not (self.folder / name / moment).exists() and time.monotonic() < deadline:
            time.sleep(0.001)
        process.send_signal(signal_number)
        _, said = process.communicate(timeout=60)
        self.assertFalse((self.folder / name / "manifest.json").exists(), "came too late to interrupt")
        return process.returncode, said

    def test_the_report_counts_what_was_packed(self):
        counts = {"views": 5, "lights": 3, "resumed_views": 0}
        self.assertEqual({key: self.report[key] for key in counts}, counts)
        self.assertAlmostEqual(self.report["surfels"], 3000, delta=600)
        views = {name: data for name, data in self.whole.items() if name.endswith(".srfb")}
        self.assertEqual(self.report["store"]["bytes"], sum(map(len, views.values())))
        self.assertEqual(set(self.report["seconds"]), {"surfels", "fades", "store"})
        self.assertGreater(self.report["memory_peak_bytes"], 0)

    def test_packing_again_gives_the_same_bytes(self):
        self.pack("again.srf")
        self.assertEqual(content(self.folder / "again.srf"), self.whole)

    def test_packing_over_a_finished_model_keeps_its_views(self):
        self.pack("twice.srf")
        self.assertEqual(self.pack("twice.srf")["resumed_views"], 5)
        self.assertEqual(content(self.folder / "twice.srf"), self.whole)

    def test_a_finished_model_of_other_options_is_replaced_only_by_overwrite(self):
        self.pack("precious.srf")
        precious = self.folder / "precious.srf"
        result = run(*self.arguments("precious.srf"), "--tolerance", "0.05")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr, f"surflect: {precious}: a finished model of another capture, geometry, "
                                        "tolerance or version of surflect: --overwrite replaces it\n")
        self.assert_same_files(content(precious), self.whole)
        self.pack("precious.srf", "--tolerance", "0.05", "--overwrite")
        self.assertNotEqual(content(precious)["views/identity"], self.whole["views/identity"])
        self.pack("precious.srf", "--overwrite")
        self.assertEqual(self.pack("precious.srf", "--overwrite")["resumed_views"], 5)
        self.assert_same_files(content(precious), self.whole)

    def test_of_an_unfinished_model_the_reader_is_told_how_it_goes_on(self):
        self.pack("unfinished.srf")
        unfinished = self.folder / "unfinished.srf"
        (unfinished / "manifest.json").unlink()
        for command in (["inspect", unfinished], ["evaluate", unfinished, self.capture]):
            with self.subTest(command=command[0]):
                result = run(*command)
                self.assertEqual(result.returncode, 1)
                self.assertEqual(result.stderr,
                                 f"surflect: {unfinished}/manifest.json: unfinished model: run the same pack again\n")

    def test_an_interrupted_run_goes_on_to_the_same_bytes(self):
        for signal_number in (signal.SIGINT, signal.SIGKILL):
            for moment, least_resumed in (("views", 0), ("views/0000.error", 1), ("views/0002.error", 3)):
                with self.subTest(signal=signal_number, moment=moment):
                    name = f"{signal_number}-{least_resumed}.srf"
                    status, said = self.interrupt(name, moment, signal_number)
                    if signal_number == signal.SIGINT:
                        self.assertEqual(status, 128 + signal.SIGINT)
                        self.assertIn("interrupted", said)
                    else:
                        self.assertEqual(status, -signal.SIGKILL)
                    self.assertGreaterEqual(self.pack(name)["resumed_views"], least_resumed)
                    left = content(self.folder / name)
                    self.assertEqual({n: d for n, d in left.items() if not n.endswith(".tmp")}, self.whole)

    def test_a_damaged_view_is_packed_anew(self):
        self.pack("damaged.srf")
        view = self.folder / "damaged.srf" / "views" / "0001.srfb"
        data = bytearray(view.read_bytes())
        data[len(data) // 2] ^= 1
        view.write_bytes(data)
        self.assertEqual(self.pack("damaged.srf")["resumed_views"], 4)
        self.assertEqual(content(self.folder / "damaged.srf"), self.whole)

    def test_a_mesh_in_another_frame_than_the_cameras_stops_unless_forced(self):
        capture = self.folder / "farther"
        write_small_capture(capture, cameras=5, lights=1)
        description = json.loads((capture / "transforms.json").read_text())
        for frame in description["frames"]:
            for row in frame["transform_matrix"][:3]:
                row[3] *= 1.4
        (capture / "transforms.json").write_text(json.dumps(description))
        model = self.folder / "farther.srf"
        result = run("pack", capture, "-o", model, "--surfels", "3000", "--tables", "off")
        self.assertEqual(result.returncode, 1)
        self.assertIn("error: the mesh and the masks differ in 5 of 5 views: ", result.stderr)
        self.assertIn(f"stopped by 1 error, see above; no model was made. surflect inspect {capture} --overlay "
                      "sheet.png shows it; --force packs anyway", result.stderr.splitlines()[-1])
        self.assertFalse(model.exists())
        forced = succeed("pack", capture, "-o", model, "--surfels", "3000", "--tables", "off", "--force")
        self.assertEqual(forced["findings"][0]["severity"], "error")
        self.assertEqual(self.report["findings"], [])

    def test_without_a_mesh_the_mattes_make_a_hull(self):
        capture = self.folder / "meshless"
        write_small_capture(capture, cameras=6, lights=1)
        description = json.loads((capture / "transforms.json").read_text())
        del description["geometry"]
        (capture / "transforms.json").write_text(json.dumps(description))
        report = succeed("pack", capture, "-o", self.folder / "hull.srf", "--surfels", "3000", "--tables", "off")
        self.assertEqual(report["geometry"], "hull")
        cameras = {f["camera"] for f in description["frames"] if f["split"] == "train"}
        self.assertEqual({fit["view"] for fit in report["silhouettes"]}, cameras)
        for fit in report["silhouettes"]:
            self.assertGreater(fit["iou"], 0.95)
            self.assertFalse(fit["left_out"])
        said = run("pack", capture, "-o", self.folder / "hull.srf", "--surfels", "3000", "--tables", "off").stderr.splitlines()
        self.assertFalse([line for line in said if "no hull fits" in line])
        summary = next(i for i, line in enumerate(said) if line.startswith("geometry: visual hull of 6 mattes"))
        lines = list(itertools.takewhile(lambda line: line.startswith("  "), said[summary + 1:]))
        fits = ", ".join(line.strip().rstrip(",") for line in lines)
        self.assertEqual(fits, ", ".join(f"{fit['view']} {fit['iou']:.3f}" for fit in report["silhouettes"]))
        self.assertLess(max(map(len, lines)), 105)

    def test_mattes_that_no_hull_fits_are_said(self):
        capture = self.folder / "misfit"
        write_small_capture(capture, cameras=6, lights=2)
        description = json.loads((capture / "transforms.json").read_text())
        del description["geometry"]
        description["cx"] += 30
        (capture / "transforms.json").write_text(json.dumps(description))
        packed = run("pack", capture, "-o", self.folder / "misfit.srf", "--surfels", "3000", "--tables", "off")
        self.assertEqual(packed.returncode, 0)
        self.assertRegex(packed.stderr, r"warning: no hull fits the mattes: found 0\.\d+ IoU, expected 0\.8 or more")


if __name__ == "__main__":
    unittest.main()
