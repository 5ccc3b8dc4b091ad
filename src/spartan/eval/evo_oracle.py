"""Metrics of two TUM files by evo (https://github.com/MichaelGrupp/evo): one line `name value` each.

Usage: evo_oracle.py ESTIMATE TRUTH ALIGNMENT MAX_DT DELTA, with ALIGNMENT one of none, first, se3, sim3.
"""
import sys

from evo.core import metrics, sync
from evo.tools import file_interface

estimate_path, truth_path, alignment, max_dt, delta = sys.argv[1:6]
truth = file_interface.read_tum_trajectory_file(truth_path)
estimate = file_interface.read_tum_trajectory_file(estimate_path)
truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=float(max_dt))
if alignment == "first":
    estimate.align_origin(truth)
elif alignment in ("se3", "sim3"):
    estimate.align(truth, correct_scale=alignment == "sim3")

relation = metrics.PoseRelation
frames = {"delta": int(delta), "delta_unit": metrics.Unit.frames, "all_pairs": True}
for name, metric in (
    ("ate_m", metrics.APE(relation.translation_part)),
    ("rpe_translation_m", metrics.RPE(relation.translation_part, **frames)),
    ("rpe_rotation_deg", metrics.RPE(relation.rotation_angle_deg, **frames)),
):
    metric.process_data((truth, estimate))
    for key in ("rmse", "mean", "median", "max"):
        print(f"{name}.{key} {metric.get_all_statistics()[key]:.12g}")
print(f"frames {truth.num_poses}")
print(f"path_length_m {truth.path_length:.12g}")
