#include "program/rig_convert.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "program/json.h"
#include "spartan/core/files.h"
#include "spartan/rig/rig_differences.h"
#include "spartan/rig/rig_files.h"
#include "spartan/rig/rig_writing.h"

namespace spartan::program {
namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string from, to, format, pair;
  std::vector<int> size_px;
  bool force = false;
};

bool is_there(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// The rig to write, with only the pair that was asked for.
Result<Rig> chosen_rig(const ReadRig& read, const std::string& pair) {
  if (pair.empty()) return read.rig;
  if (const StereoPair* chosen = read.rig.find_pair(pair)) return rig_of_pair(read.rig, *chosen);
  std::vector<std::string> names;
  names.reserve(read.rig.pairs.size());
  for (const StereoPair& each : read.rig.pairs) names.push_back(each.name);
  return failure(ErrorCode::usage, fmt::format("there is no pair '{}', only {}", pair, fmt::join(names, ", ")),
                 "--pair");
}

// A mask's path counts from its rig file, and has to be found from the new one too.
void move_masks(Rig& rig, const std::string& from, const std::string& to) {
  for (Camera& camera : rig.cameras) {
    if (camera.self_mask.empty() || fs::path(camera.self_mask).is_absolute()) continue;
    const fs::path mask = fs::absolute(from).parent_path() / camera.self_mask;
    camera.self_mask =
        mask.lexically_normal().lexically_relative(fs::absolute(to).parent_path().lexically_normal()).string();
  }
}

Status write_all(const CalibrationFiles& files, bool force) {
  for (const CalibrationFile& file : files) {
    if (!force && is_there(file.path)) {
      return failure(ErrorCode::output, "is there already", file.path, "--force writes over it");
    }
  }
  for (const CalibrationFile& file : files) {
    const std::string folder = fs::path(file.path).parent_path().string();
    if (Status made = folder.empty() ? Status() : make_folder(folder); !made) return made;
    if (Status written = write_file_atomically(file.path, file.content); !written) return written;
  }
  return {};
}

// Names of cameras, pairs and rigs that a reader invents cannot be lost.
bool is_a_name(const RigDifference& difference) {
  return difference.key == "name" || difference.key.ends_with(".name");
}

// What --pair left out.
std::vector<RigDifference> left_out(const Rig& source, const Rig& chosen) {
  std::vector<RigDifference> out;
  for (const Camera& camera : source.cameras) {
    if (!chosen.find_camera(camera.name)) out.push_back({"cameras." + camera.name, "left out, as --pair says"});
  }
  for (const StereoPair& pair : source.pairs) {
    if (!chosen.find_pair(pair.name)) out.push_back({"pairs." + pair.name, "left out, as --pair says"});
  }
  return out;
}

// What the files do not say of the rig: they are read again.
Result<std::vector<RigDifference>> losses(const ReadRig& source, const Rig& written, CalibrationFormat format,
                                          const std::string& path) {
  const ImageSize size = written.find_camera(written.pairs.front().left)->size;
  const auto again = read_calibration(path, size);
  if (!again) {
    return failure(ErrorCode::internal, "what was written cannot be read: " + again.error().message(), path);
  }
  std::vector<RigDifference> lost = left_out(source.rig, written);
  for (RigDifference& each : describe_differences(written, again->rig)) lost.push_back(std::move(each));
  if (source.format != CalibrationFormat::rig_yaml) std::erase_if(lost, is_a_name);
  if (!holds_image_size(format)) {
    lost.push_back(
        {"size_px", fmt::format("these files do not hold the image size, {} x {}", size.width, size.height)});
  }
  return lost;
}

std::string in_words(const ReadRig& read, CalibrationFormat format, const CalibrationFiles& files,
                     const std::vector<RigDifference>& lost) {
  std::string text = fmt::format("read {}: {}\n", name_of(read.format), fmt::join(read.files, ", "));
  for (const std::string& note : read.notes) text += "  " + note + "\n";
  text += fmt::format("wrote {}:", name_of(format));
  for (const CalibrationFile& file : files) text += " " + file.path;
  text += lost.empty() ? "\nnothing lost\n" : "\nlost:\n";
  for (const RigDifference& each : lost) text += fmt::format("  {}: {}\n", each.key, each.text);
  return text;
}

std::string in_json(CalibrationFormat format, const CalibrationFiles& files, const std::vector<RigDifference>& lost) {
  Json paths = Json::array(), losses = Json::array();
  for (const CalibrationFile& file : files) paths.push_back(file.path);
  for (const RigDifference& each : lost) losses.push_back({{"key", each.key}, {"text", each.text}});
  const Json all = {{"schema", 1}, {"format", name_of(format)}, {"files", paths}, {"lost", losses}};
  return all.dump(2) + "\n";
}

Result<ExitCode> convert(const Context& context, const ConvertArguments& a) {
  if (const Status there = calibration_is_there(a.from); !there) return failure(there);
  const auto named = calibration_format_named(a.format);
  const auto format = named ? Result<CalibrationFormat>(*named) : format_for_name(a.to);
  if (!format) return failure(format);
  const auto read = read_calibration(a.from, a.size_px.empty() ? ImageSize{} : ImageSize{a.size_px[0], a.size_px[1]});
  if (!read) return failure(read);
  auto rig = chosen_rig(*read, a.pair);
  if (!rig) return failure(rig);
  if (*format == CalibrationFormat::rig_yaml) move_masks(*rig, read->files.front(), a.to);
  const auto files = to_calibration_files(*rig, *format, a.to);
  if (!files) return failure(files);
  if (const Status written = write_all(*files, a.force); !written) return failure(written);
  // Formats with a file for each eye are read by both names, others by the first: EuRoC's finds its folder.
  const std::string to_read =
      has_a_file_per_eye(*format) ? (*files)[0].path + "," + (*files)[1].path : (*files)[0].path;
  const auto lost = losses(*read, *rig, *format, to_read);
  if (!lost) return failure(lost);
  const std::string told = context.json ? in_json(*format, *files, *lost) : in_words(*read, *format, *files, *lost);
  if (Status printed = print(told); !printed) return failure(printed);
  return kDone;
}

}  // namespace

Status calibration_is_there(const std::string& path) {
  const std::size_t comma = path.find(',');
  std::vector<std::string> files{path};
  if (!is_there(path) && comma != std::string::npos) files = {path.substr(0, comma), path.substr(comma + 1)};
  for (const std::string& file : files) {
    if (!is_there(file)) {
      return failure(ErrorCode::input, "no such file or folder", file,
                     "a calibration file, LEFT,RIGHT, or a folder that holds one");
    }
  }
  return {};
}

void add_rig_convert(CLI::App& rig, Context& context) {
  auto a = std::make_shared<ConvertArguments>();
  CLI::App* verb =
      add_verb(rig, context, "convert", "Write a calibration in another format, and say what was lost",
               "rig convert $SPARTAN_DATA/k10_pair k10.cahvor", [&context, a] { return convert(context, *a); });
  verb->add_option("from", a->from, "any calibration: a file, LEFT,RIGHT, or a folder that holds one")
      ->required()
      ->option_text("A");
  verb->add_option(
          "to", a->to,
          "the file to write; LEFT,RIGHT or one name that becomes two where a format has a file for each eye; a "
          "folder for EuRoC. Files that are there already are kept, and that is an error")
      ->required()
      ->option_text("B");
  std::vector<std::string> names;
  for (const std::string_view name : calibration_format_names()) names.emplace_back(name);
  verb->add_option("--to", a->format, "the format of B, where its name does not tell")->check(CLI::IsMember(names));
  verb->add_option("--pair", a->pair, "only this pair of the rig");
  verb->add_option("--size-px", a->size_px, "the image size, W,H, where A does not hold it")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 32767));
  verb->add_flag("--force", a->force, "write over files that are there already");
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
