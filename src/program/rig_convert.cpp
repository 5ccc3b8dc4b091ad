#include "program/rig_convert.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "program/json.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/rig/describe.h"

namespace spartan::program {
namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string from, to, format, pair;
  std::vector<int> size_px;
};

bool is_there(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// The rig to write, reduced to the requested pair.
Result<Rig> chosen_rig(const LoadedRig& read, const std::string& pair) {
  if (pair.empty()) return read.rig;
  if (const StereoPair* chosen = read.rig.find_pair(pair)) return rig_of_pair(read.rig, *chosen);
  std::vector<std::string> names;
  names.reserve(read.rig.pairs.size());
  for (const StereoPair& each : read.rig.pairs) names.push_back(each.name);
  return failure(ErrorCode::usage, fmt::format("the rig has no pair '{}'; it has: {}", pair, fmt::join(names, ", ")),
                 "--pair");
}

// The folder with symbolic links resolved, so that ".." is correct.
fs::path real_folder_of(const fs::path& file) {
  std::error_code error;
  const fs::path folder = fs::absolute(file).parent_path();
  const fs::path real = fs::weakly_canonical(folder, error);
  return error ? folder.lexically_normal() : real;
}

// A given size must agree with the size that the files hold.
Status check_size(const Rig& rig, ImageSize given) {
  for (const Camera& camera : rig.cameras) {
    if (given.empty() || camera.size == given) continue;
    return failure(ErrorCode::usage,
                   fmt::format("contradicts the files: camera {} has {} x {} px", camera.name, camera.size.width,
                               camera.size.height),
                   "--size-px", "omit it");
  }
  return {};
}

// The name must be recognized as this format when the file is read again.
Status check_names(const CalibrationFiles& files, CalibrationFormat format, const std::string& to) {
  const CalibrationFile& first = files.front();
  if (const auto guess = detect_calibration_format(first.path, first.content); guess != format) {
    return failure(ErrorCode::usage,
                   fmt::format("a file of this name would be read as {}, not as {}",
                               guess ? name_of(*guess) : "nothing", name_of(format)),
                   first.path, "choose another extension");
  }
  if (!has_file_per_camera(format)) return {};
  if (first.path == files.at(1).path) return failure(ErrorCode::usage, "is the same file for both cameras", to);
  if (first.path.find(',') != std::string::npos) {
    return failure(ErrorCode::usage, "is neither one name nor LEFT,RIGHT", to, "file names must not contain a comma");
  }
  return {};
}

Status check_places(const CalibrationFiles& files, const Context& context) {
  for (const CalibrationFile& file : files) {
    if (Status s = expect_new_file(context, file.path); !s) return s;
  }
  return {};
}

// Names that a reader makes up are not counted as lost.
bool is_a_name(const RigDifference& difference) {
  return difference.key == "name" || difference.key.ends_with(".name");
}

// What --pair excluded.
std::vector<RigDifference> not_chosen(const Rig& source, const Rig& chosen) {
  std::vector<RigDifference> out;
  for (const Camera& camera : source.cameras) {
    if (!chosen.find_camera(camera.name)) out.push_back({"cameras." + camera.name, "excluded by --pair"});
  }
  for (const StereoPair& pair : source.pairs) {
    if (!chosen.find_pair(pair.name)) out.push_back({"pairs." + pair.name, "excluded by --pair"});
  }
  return out;
}

// What the reader did not use, and every difference found by reading the new files back.
Result<std::vector<RigDifference>> losses(const LoadedRig& source, const Rig& written, CalibrationFormat format,
                                          const CalibrationFiles& files) {
  const ImageSize size = written.find_camera(written.pairs.front().left)->size;
  const auto again = read_back(files, format, size);
  if (!again && again.error().code == ErrorCode::output) return failure(again);
  if (!again) {
    return failure(ErrorCode::internal,
                   "nothing is written, because the result could not be read back: " + again.error().message());
  }
  std::vector<RigDifference> differences = describe_differences(written, again->rig);
  if (source.format != CalibrationFormat::rig_yaml) std::erase_if(differences, is_a_name);
  std::vector<RigDifference> lost = source.ignored;
  for (RigDifference& each : not_chosen(source.rig, written)) lost.push_back(std::move(each));
  for (RigDifference& each : differences) lost.push_back(std::move(each));
  if (!contains_image_size(format)) {
    lost.push_back(
        {"size_px", fmt::format("these files do not hold the image size, {} x {}", size.width, size.height)});
  }
  return lost;
}

std::string conversion_to_text(const LoadedRig& read, CalibrationFormat format, const CalibrationFiles& files,
                               const std::vector<RigDifference>& lost) {
  std::string text = fmt::format("read {}: {}\n", name_of(read.format), fmt::join(read.files, ", "));
  for (const std::string& note : read.notes) text += "  " + note + "\n";
  text += fmt::format("wrote {}:", name_of(format));
  for (const CalibrationFile& file : files) text += " " + file.path;
  text += lost.empty() ? "\nnothing lost\n" : "\nlost:\n";
  for (const RigDifference& each : lost) text += fmt::format("  {}: {}\n", each.key, each.text);
  return text;
}

std::string conversion_to_json(const LoadedRig& read, CalibrationFormat format, const CalibrationFiles& files,
                               const std::vector<RigDifference>& lost) {
  Json paths = Json::array(), losses = Json::array();
  for (const CalibrationFile& file : files) paths.push_back(file.path);
  for (const RigDifference& each : lost) losses.push_back({{"key", each.key}, {"text", each.text}});
  const Json all = {{"schema", 1},         {"format", name_of(format)},
                    {"files", paths},      {"body", read.body.empty() ? Json(nullptr) : Json(read.body)},
                    {"notes", read.notes}, {"lost", losses}};
  return text_of(all) + "\n";
}

Result<ExitCode> convert(const Context& context, const ConvertArguments& a) {
  if (const Status there = calibration_is_there(a.from); !there) return failure(there);
  const auto named = calibration_format_named(a.format);
  const auto format = named ? Result<CalibrationFormat>(*named) : calibration_format_for_path(a.to);
  if (!format) return failure(format);
  const ImageSize size = a.size_px.empty() ? ImageSize{} : ImageSize{a.size_px[0], a.size_px[1]};
  const auto read = read_calibration(a.from, size);
  if (!read) return failure(read);
  if (const Status sized = check_size(read->rig, size); !sized) return failure(sized);
  auto rig = chosen_rig(*read, a.pair);
  if (!rig) return failure(rig);
  if (*format == CalibrationFormat::rig_yaml) rig = with_masks_moved(std::move(*rig), read->files.front(), a.to);
  const auto files = to_calibration_files(*rig, *format, a.to);
  if (!files) return failure(files);
  if (const Status names = check_names(*files, *format, a.to); !names) return failure(names);
  if (const Status places = check_places(*files, context); !places) return failure(places);
  const auto lost = losses(*read, *rig, *format, *files);
  if (!lost) return failure(lost);
  if (const Status written = write_calibration_files(*files); !written) return failure(written);
  const std::string text = context.json ? conversion_to_json(*read, *format, *files, *lost)
                                        : conversion_to_text(*read, *format, *files, *lost);
  if (Status printed = print(text); !printed) return failure(printed);
  return kDone;
}

}  // namespace

Rig with_masks_moved(Rig rig, const std::string& from_file, const std::string& to_file) {
  const fs::path from = real_folder_of(from_file), to = real_folder_of(to_file);
  for (Camera& camera : rig.cameras) {
    if (camera.self_mask.empty() || fs::path(camera.self_mask).is_absolute()) continue;
    const fs::path mask = from / camera.self_mask;
    camera.self_mask = (real_folder_of(mask) / mask.filename()).lexically_relative(to).string();
  }
  return rig;
}

Status calibration_is_there(const std::string& path) {
  const std::size_t comma = path.find(',');
  std::vector<std::string> files{path};
  if (!is_there(path) && comma != std::string::npos) files = {path.substr(0, comma), path.substr(comma + 1)};
  for (const std::string& file : files) {
    if (!is_there(file)) {
      return failure(ErrorCode::input, "no such file or folder", file,
                     "give a calibration file, LEFT,RIGHT, or a folder that holds one");
    }
  }
  return {};
}

void add_rig_convert(CLI::App& rig, Context& context) {
  auto a = std::make_shared<ConvertArguments>();
  CLI::App* command = add_command(
      rig, context, "convert", "Convert a calibration to another format, and list what the format cannot hold",
      "rig convert $SPARTAN_DATA/k10_pair k10.cahvor", [&context, a] { return convert(context, *a); });
  command->add_option("from", a->from, "Calibration to read: a file, LEFT,RIGHT, or a folder that holds one.")
      ->required()
      ->option_text("A REQUIRED");
  command
      ->add_option(
          "to", a->to,
          "File to write; for formats with one file per camera LEFT,RIGHT or one name for both; for EuRoC a folder. "
          "Existing files are an error without --force.")
      ->required()
      ->option_text("B REQUIRED");
  std::vector<std::string> names;
  for (const std::string_view name : calibration_format_names()) names.emplace_back(name);
  command->add_option("--to", a->format, "Format of the written calibration B (default: from its name).")
      ->check(CLI::IsMember(names));
  command->add_option("--pair", a->pair, "Convert only this pair of the rig (default: all).");
  command
      ->add_option("--size-px", a->size_px,
                   "Image size W,H in pixels, for formats that do not hold it or hold several (default: that of the "
                   "calibration).")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 32767));
  add_force_flag(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
