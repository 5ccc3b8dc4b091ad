// The parts of the Python module `spartan._core`, each bound by a file of its own.
#pragma once

#include <nanobind/nanobind.h>

namespace spartan::python {

void bind_errors(nanobind::module_& m);
void bind_poses(nanobind::module_& m);
void bind_trajectories(nanobind::module_& m);
void bind_options(nanobind::module_& m);
void bind_camera_models(nanobind::module_& m);
void bind_rigs(nanobind::module_& m);
void bind_calibrations(nanobind::module_& m);
void bind_samples(nanobind::module_& m);
void bind_recordings(nanobind::module_& m);
void bind_recording_writer(nanobind::module_& m);
void bind_imaging(nanobind::module_& m);
void bind_stereo(nanobind::module_& m);
void bind_point_clouds(nanobind::module_& m);
void bind_odometry(nanobind::module_& m);
void bind_localization(nanobind::module_& m);
void bind_local_maps(nanobind::module_& m);
void bind_global_maps(nanobind::module_& m);
void bind_pipeline(nanobind::module_& m);
void bind_runs(nanobind::module_& m);
void bind_run_results(nanobind::module_& m);
void bind_evaluation(nanobind::module_& m);
void bind_rig_design(nanobind::module_& m);
void bind_simulation(nanobind::module_& m);

}  // namespace spartan::python
