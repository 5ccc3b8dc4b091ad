#include "spartan/report/internal/run_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>
#include <vector>

#include "spartan/figures/html.h"
#include "spartan/rig/describe.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

// What a reader of a link may not see as it is.
std::string url_of(const std::string& path) {
  std::string url;
  for (const char c : path) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || std::string("/._-~").find(c) != std::string::npos;
    url += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return url;
}

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unreadable;
    const bool kept = it->path().filename() != "owner.lock";  // it ends with the run
    if (kept && it->is_regular_file(unreadable)) files.push_back(it->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Files of the run folder itself; those of each folder below it behind one line.
std::string file_list(const std::string& run, const fs::path& from) {
  std::string list, nested;
  fs::path group;
  int count = 0;
  const auto close = [&] {
    if (count > 0) {
      list += fmt::format("<details><summary>{}/ ({} files)</summary><ul class=\"files\">{}</ul></details>\n",
                          html_text(group.string()), count, nested);
    }
    nested.clear();
    count = 0;
  };
  std::string direct;
  for (const fs::path& file : files_of(run)) {
    const fs::path in_run = file.lexically_relative(run);
    const std::string link =
        fmt::format("<li><a href=\"{}\">{}</a></li>\n", url_of(file.lexically_relative(from).string()),
                    html_text(in_run.filename().string()));
    if (!in_run.has_parent_path()) {
      direct += link;
      continue;
    }
    if (in_run.parent_path() != group) {
      close();
      group = in_run.parent_path();
    }
    nested += link;
    ++count;
  }
  close();
  return "<h3>Files</h3>\n<ul class=\"files\">" + direct + "</ul>\n" + list;
}

}  // namespace

std::string rig_section(const Rig& rig) {
  std::vector<std::vector<std::string>> rows{
      {"pair", "cameras", "image, px", "model", "focal length, px", "field of view", "baseline", "used for"}};
  for (const StereoPair& pair : rig.pairs) {
    const PairSummary s = summarize_pair(rig, pair);
    const Camera* left = rig.find_camera(pair.left);
    rows.push_back({pair.name, pair.left + ", " + pair.right,
                    fmt::format("{} × {}", left->size.width, left->size.height), std::string(name_of(left->model)),
                    fmt::format("{:.1f}", s.focal_px), fmt::format("{:.1f}° × {:.1f}°", s.hfov_deg, s.vfov_deg),
                    describe_length(s.baseline_m), pair.for_odometry ? "odometry, maps" : "maps at stops"});
  }
  return html_table("Rig " + rig.name, rows);
}

std::string time_section(const nlohmann::ordered_json& summary) {
  std::vector<std::vector<std::string>> rows{{"stage", "count", "median, ms", "95th percentile, ms", "CPU median, ms"}};
  for (const auto& [name, stage] : summary["stages"].items()) {
    rows.push_back({name, std::to_string(stage["count"].get<int>()),
                    fmt::format("{:.1f}", stage["wall_ms"]["median"].get<double>()),
                    fmt::format("{:.1f}", stage["wall_ms"]["p95"].get<double>()),
                    fmt::format("{:.1f}", stage["cpu_ms"]["median"].get<double>())});
  }
  const double seconds = summary["wall_seconds"].get<double>();
  return html_table("Time of each stage", rows) +
         fmt::format(
             "<p>{:.1f} frames/s: {} frames in {:.1f} s ({:.1f} s of CPU) with {} threads; peak memory {:.0f} "
             "MB.</p>\n",
             seconds > 0 ? summary["frames"].get<double>() / seconds : 0.0, summary["frames"].get<int>(), seconds,
             summary["cpu_seconds"].get<double>(), summary["threads"].get<int>(),
             summary["peak_memory_bytes"].get<double>() / 1e6) +
         "<p>Stages: camera reads images; reconstruction is dense stereo; mapping makes local maps and slam merges "
         "them; "
         "maps and terrain write files.</p>\n";
}

std::string run_section(const nlohmann::ordered_json& summary, const ReportRequest& request,
                        const RecordingInfo& info) {
  std::string html = "<div class=\"table text\" tabindex=\"0\" role=\"region\" aria-label=\"This run\"><table>";
  const auto add = [&](const std::string& name, const std::string& value) {
    if (!value.empty())
      html += "<tr><th scope=\"row\">" + html_text(name) + "</th><td>" + html_text(value) + "</td></tr>\n";
  };
  add("Spartan", summary["version"].get<std::string>());
  add("page written", request.date);
  add("command", request.command_line);
  add("recording", info.path + " (" + summary["format"].get<std::string>() + ")");
  add("calibration", info.rig_source);
  add("truth", request.truth);
  html += "</table></div>\n";
  if (request.page.empty()) return html;
  return html + file_list(request.run, fs::path(request.page).parent_path());
}

}  // namespace spartan::internal
