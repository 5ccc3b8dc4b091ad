// What somebody else writes to use the camera models alone: projects a point with the left camera of a rig file.
#include <cmath>
#include <cstdio>

#include "spartan/rig/rig.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto rig = spartan::read_rig_yaml(argv[1]);
  if (!rig) {
    std::fprintf(stderr, "%s\n", rig.error().message().c_str());
    return 1;
  }
  const spartan::Camera& camera = *rig->find_camera(rig->pairs.front().left);
  const Eigen::Vector3d point(0.1, -0.2, 2);
  const auto pixel = spartan::project(camera.model, point);
  const auto ray = pixel ? spartan::unproject(camera.model, *pixel) : std::nullopt;
  if (!ray) return 1;
  std::printf("%s: (0.1, -0.2, 2) m is at (%.3f, %.3f) px\n", camera.name.c_str(), pixel->x(), pixel->y());
  return (ray->direction - point.normalized()).norm() < 1e-9 ? 0 : 1;
}
