// The scripts that draw terrain and trajectories in 3D: three.js, and scene.js, which defines makeScene().
#pragma once

#include <span>

#include "spartan/figures/embedded_file.h"

namespace spartan::internal {

/// In the order in which a page runs them.
std::span<const EmbeddedFile> scene_files();

}  // namespace spartan::internal
