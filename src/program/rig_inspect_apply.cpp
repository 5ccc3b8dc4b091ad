#include "program/rig_inspect_apply.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "program/rig_convert.h"
#include "spartan/core/files.h"
#include "spartan/core/image_io.h"
#include "spartan/rig/inspection/pairs_together.h"

namespace spartan::program {
namespace {

// Without a file the rig is a guess.
bool is_guess(const ReadRig& read) {
  return read.files.empty();
}

Status write_rig(const Rig& rig, const ReadRig& read, const std::string& path) {
  const std::string remark =
      is_guess(read) ? "# Made of pictures alone: the focal length is a guess, and the baseline of 1 m none at all.\n"
                     : "";
  return write_file_atomically(path, remark + to_rig_yaml(rig));
}

// What kind of rig it is.
std::string in_words(const Rig& rig, const ReadRig& read, const std::vector<InspectedPair>& inspected,
                     const std::string& path) {
  const char* as_before = is_guess(read) ? "the rig as guessed" : "the rig as given";
  const auto any = [&](const auto& what) { return std::any_of(inspected.begin(), inspected.end(), what); };
  if (!any([](const InspectedPair& i) { return i.judged(); }))
    return fmt::format("nothing could be judged: {} is {}", path, as_before);
  if (!(rig == read.rig)) return fmt::format("the corrected rig: {}", path);
  const bool found = any([](const InspectedPair& i) { return !i.check.findings.empty(); });
  return fmt::format("{}: {} is {}",
                     found ? "nothing of what was found can be put right" : "nothing is to be put right", path,
                     as_before);
}

// A mask is a picture of its own, which no correction changes.
void tell_of_masks(const Rig& rig, const Rig& given, const std::string& folder, std::vector<std::string>& sentences) {
  for (const Camera& camera : rig.cameras) {
    if (camera.self_mask.empty() || camera.size == given.find_camera(camera.name)->size) continue;
    const auto mask = read_gray8((std::filesystem::path(folder) / camera.self_mask).string());
    if (mask && mask->size() == camera.size) continue;
    sentences.push_back(
        fmt::format("camera {}: its self-mask {} is still that of the other size: it must be {} x {} px", camera.name,
                    camera.self_mask, camera.size.width, camera.size.height));
  }
}

}  // namespace

Result<std::vector<std::string>> write_corrected_rig(const ReadRig& read, const std::vector<InspectedPair>& inspected,
                                                     const std::string& path) {
  std::vector<CorrectedPair> corrected;
  for (const InspectedPair& one : inspected) {
    if (!one.check.corrected) {
      return failure(ErrorCode::input,
                     fmt::format("is not written: nothing explains the pictures of pair {}, so there is nothing to "
                                 "put right",
                                 one.pair.name),
                     path, "look at the pictures, or run without --apply for the figures");
    }
    // What could not be judged holds nothing fast.
    if (one.judged()) corrected.push_back({one.pair.name, *one.check.corrected});
  }
  const RigOfPairs together = take_together(read.rig, corrected);
  const Rig moved = is_guess(read) ? together.rig : with_masks_moved(together.rig, read.files.front(), path);
  if (Status written = write_rig(moved, read, path); !written) return failure(written);

  std::vector<std::string> sentences{in_words(together.rig, read, inspected, path)};
  for (const InspectedPair& one : inspected) {
    if (!one.judged() && !corrected.empty())
      sentences.push_back(fmt::format("pair {}: could not be judged, and nothing is put right for it", one.pair.name));
  }
  for (const std::string& pair : together.left_out) {
    sentences.push_back(
        fmt::format("pair {}: it has its cameras in common with the pairs before it, and what its pictures want does "
                    "not go with those: its correction is not taken in. Inspect {} again",
                    pair, path));
  }
  tell_of_masks(moved, read.rig, std::filesystem::path(path).parent_path().string(), sentences);
  return sentences;
}

}  // namespace spartan::program
