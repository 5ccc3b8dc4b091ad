// The files of the page that are its own; those that draw the scene are scene_files().
#pragma once

#include <span>

#include "spartan/figures/embedded_file.h"

namespace spartan::viewer {

std::span<const EmbeddedFile> page_files();

}  // namespace spartan::viewer
