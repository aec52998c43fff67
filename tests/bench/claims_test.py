"""What the paper claims, held to theory: the laws that the figures of `claims` obey."""

import collections
import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest


def measure():
    with tempfile.TemporaryDirectory() as folder:
        command = [os.environ["CLAIMS"], pathlib.Path(folder) / "claims"]
        return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)


class Claims(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.report = measure()

    def test_preservation_is_exact_where_the_impostor_is_the_object(self):
        for warp, curve in self.report["impostor_limit"].items():
            self.assertEqual(curve[-1]["distance"], 0)
            self.assertLess(curve[-1]["error"], 1.5e-7, warp)  # tangents are floats
            self.assertGreater(curve[-1]["queries"], 3900)

    def test_error_falls_linearly_with_the_distance_of_the_impostor(self):
        for warp in ("twist", "bend", "stretch"):
            curve = self.report["impostor_limit"][warp][:-1]
            for quantity in ("error", "shift"):
                ratios = [near[quantity] / far[quantity] for far, near in zip(curve, curve[1:])]
                self.assertAlmostEqual(ratios[-1], 0.5, delta=0.01, msg=f"{warp} {quantity}")
                # What deviates from the line is of higher order: it shrinks as well.
                departures = [abs(ratio - 0.5) for ratio in ratios]
                self.assertEqual(departures, sorted(departures, reverse=True), f"{warp} {quantity}")
            self.assertGreater(curve[0]["error"], 0.03, f"{warp}: an error that cannot fail to fall")

    def test_a_rigid_object_needs_no_exact_impostor(self):
        for point in self.report["impostor_limit"]["rigid"]:
            self.assertLess(point["error"], 1.5e-7)

    def test_texture_moves_as_stated(self):
        shifts = collections.Counter()
        for row in self.report["texture_parallax"]:
            # The least of them but 0 is 0.0088; a pixel is 0.0244 of the plate.
            self.assertAlmostEqual(row["measured"], row["stated"], delta=2e-4, msg=str(row))
            shifts[row["stated"] == 0] += 1
        self.assertEqual(shifts, {True: 3, False: 6})

    def test_look_up_turns_by_the_closed_forms(self):
        for row in self.report["fibre_azimuth"]:
            turns = {"truth": 0 if row["fibre_deg"] == 0 else math.atan(row["shear"]),
                     "polar": math.atan(row["shear"] / 2), "bisector": math.atan(row["shear"]) / 2}
            for name, turn in turns.items():
                self.assertAlmostEqual(row[f"{name}_stated_deg"], row["fibre_deg"] - math.degrees(turn), places=9)

    def test_highlights_turn_as_stated(self):
        for row in self.report["fibre_azimuth"]:
            for name in ("truth", "polar", "bisector"):
                departure = row[f"{name}_deg"] - row[f"{name}_stated_deg"]
                departure = (departure + 90) % 180 - 90  # a fibre has no direction
                self.assertLess(abs(departure), 0.25, f"{name} {row}")

    def test_polar_factor_is_nearer_to_the_fibres_on_average(self):
        for row in self.report["fibre_error"]:
            self.assertLess(row["polar_rms_deg"], row["bisector_rms_deg"])


if __name__ == "__main__":
    unittest.main()
