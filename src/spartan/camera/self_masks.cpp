// Where the self-masks of a rig are, and their copies beside a rig that is stored elsewhere.
#include <filesystem>

#include "spartan/camera/recording_writer.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/files.h"

namespace spartan {

namespace fs = std::filesystem;

std::string StreamInfo::mask_folder() const {
  return fs::path(rig_source).parent_path().string();
}

Result<Rig> with_self_masks_in(const std::string& to, Rig rig, const std::string& from) {
  for (Camera& camera : rig.cameras) {
    if (camera.self_mask.empty()) continue;
    const fs::path mask = fs::path(from) / camera.self_mask;
    auto content = read_file(mask.string());
    if (!content) {
      content.error().code = ErrorCode::configuration;
      return failure(content);
    }
    const fs::path copy = fs::path("masks") / (camera.name + mask.extension().string());
    if (Status s = make_folder((fs::path(to) / "masks").string()); !s) return failure(s);
    if (Status s = write_file_atomically((fs::path(to) / copy).string(), *content); !s) return failure(s);
    camera.self_mask = copy.string();
  }
  return rig;
}

}  // namespace spartan
