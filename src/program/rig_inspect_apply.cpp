#include "program/rig_inspect_apply.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "program/rig_convert.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"

namespace spartan::program {
namespace {

// Without a calibration file the rig is an assumption.
bool is_assumed(const LoadedRig& read) {
  return read.files.empty();
}

Status write_rig(const Rig& rig, const LoadedRig& read, const std::string& path) {
  const std::string remark =
      is_assumed(read)
          ? "# Made from images alone: the focal length is an assumption, and the baseline of 1 m arbitrary.\n"
          : "";
  return write_file_atomically(path, remark + to_rig_yaml(rig));
}

// What the written file holds.
std::string to_text(const Rig& rig, const LoadedRig& read, const std::vector<InspectedPair>& inspected,
                    const std::string& path) {
  const char* as_before = is_assumed(read) ? "the assumed rig" : "the given rig";
  const auto any = [&](const auto& what) { return std::any_of(inspected.begin(), inspected.end(), what); };
  if (!any([](const InspectedPair& i) { return i.checked(); }))
    return fmt::format("no pair could be checked: {} holds {}", path, as_before);
  if (!(rig == read.rig)) return fmt::format("the corrected rig: {}", path);
  const bool found = any([](const InspectedPair& i) { return !i.check.findings.empty(); });
  return fmt::format("{}: {} holds {}", found ? "no finding can be corrected" : "nothing needs correction", path,
                     as_before);
}

// Self-masks are image files, which no correction changes.
void add_mask_notes(const Rig& rig, const Rig& given, const std::string& folder, std::vector<std::string>& sentences) {
  for (const Camera& camera : rig.cameras) {
    if (camera.self_mask.empty() || camera.size == given.find_camera(camera.name)->size) continue;
    const auto mask = read_gray8((std::filesystem::path(folder) / camera.self_mask).string());
    if (mask && mask->size() == camera.size) continue;
    sentences.push_back(
        fmt::format("camera {}: its self-mask {} does not have the corrected size {} x {} px: replace it", camera.name,
                    camera.self_mask, camera.size.width, camera.size.height));
  }
}

}  // namespace

Result<std::vector<std::string>> write_corrected_rig(const LoadedRig& read, const std::vector<InspectedPair>& inspected,
                                                     const std::string& path) {
  std::vector<CorrectedPair> corrected;
  for (const InspectedPair& one : inspected) {
    if (!one.check.corrected) {
      return failure(ErrorCode::input,
                     fmt::format("is not written: no hypothesis explains the images of pair {}, so there is no "
                                 "correction",
                                 one.pair.name),
                     path, "check the images, or run without --apply to print the row errors");
    }
    // A pair that could not be checked does not constrain the others.
    if (one.checked()) corrected.push_back({one.pair.name, *one.check.corrected});
  }
  const MergedRig together = merge_corrections(read.rig, corrected);
  const Rig moved = is_assumed(read) ? together.rig : with_masks_moved(together.rig, read.files.front(), path);
  if (Status written = write_rig(moved, read, path); !written) return failure(written);

  std::vector<std::string> sentences{to_text(together.rig, read, inspected, path)};
  for (const InspectedPair& one : inspected) {
    if (!one.checked() && !corrected.empty())
      sentences.push_back(fmt::format("pair {}: could not be checked and is not corrected", one.pair.name));
  }
  for (const std::string& pair : together.discarded) {
    sentences.push_back(
        fmt::format("pair {}: its correction is not applied, because it contradicts that of another pair with the same "
                    "cameras. Inspect {} again",
                    pair, path));
  }
  add_mask_notes(moved, read.rig, std::filesystem::path(path).parent_path().string(), sentences);
  return sentences;
}

}  // namespace spartan::program
