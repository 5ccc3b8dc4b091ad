// The extension module behind the package `spartan`.
#include <nanobind/nanobind.h>

#include "bindings/bindings.h"

NB_MODULE(_core, m) {
  using namespace spartan::python;
  m.doc() = "Bindings of the C++ library; use the package `spartan`.";
  m.attr("__version__") = SPARTAN_VERSION;
  bind_errors(m);
  bind_poses(m);
  bind_trajectories(m);
  bind_options(m);
  bind_camera_models(m);
  bind_rigs(m);
  bind_calibrations(m);
  bind_samples(m);
  bind_recording_writer(m);
  bind_recordings(m);
  bind_imaging(m);
  bind_stereo(m);
  bind_point_clouds(m);
  bind_odometry(m);
  bind_localization(m);
  bind_local_maps(m);
  bind_global_maps(m);
  bind_pipeline(m);
  bind_run_results(m);
  bind_runs(m);
  bind_evaluation(m);
  bind_rig_design(m);
  bind_simulation(m);
}
