// Plots power spectra of soil as SVG: simulated ones as lines over the band around those of real patches.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace spartan {

inline constexpr std::array<double, 6> kFrequencies{0.05, 0.1, 0.15, 0.2, 0.3, 0.4};  // cycles per pixel
using Spectrum = std::array<double, kFrequencies.size()>;                             // power normalized by the first

class SpectrumPlot {
 public:
  void add_real(const std::string& name, const Spectrum& power) { real_.push_back({name, power}); }
  void add_simulated(const std::string& name, const Spectrum& power) { simulated_.push_back({name, power}); }

  std::string svg() const {
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"12\">\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        kWidth, kHeight);
    out += axes() + band();
    for (const Line& line : real_) out += polyline(line, "#777", "2.5", "6 4");
    std::size_t i = 0;
    for (const Line& line : simulated_) out += polyline(line, kColours[i++ % kColours.size()], "1.3", "");
    return out + legend() + "</svg>\n";
  }

 private:
  struct Line {
    std::string name;
    Spectrum power;
  };
  static constexpr int kWidth = 860, kHeight = 520, kLeft = 60, kTop = 30, kRight = 560, kBottom = 470;
  static constexpr double kLowest = 1e-3, kHighest = 2;
  static constexpr std::array<const char*, 8> kColours{"#c0392b", "#2471a3", "#1e8449", "#b7950b",
                                                       "#7d3c98", "#117a65", "#d35400", "#34495e"};

  static double x_of(double frequency) {
    return kLeft + (kRight - kLeft) * std::log(frequency / kFrequencies.front()) /
                       std::log(kFrequencies.back() / kFrequencies.front());
  }
  static double y_of(double power) {
    return kBottom -
           (kBottom - kTop) * std::log(std::clamp(power, kLowest, kHighest) / kLowest) / std::log(kHighest / kLowest);
  }

  static std::string axes() {
    std::string out;
    for (const double f : kFrequencies) {
      out += fmt::format(
          "<path d=\"M{0:.1f} {1} V{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4}"
          "</text>\n",
          x_of(f), kTop, kBottom, kBottom + 16, f);
    }
    for (const double p : {0.001, 0.01, 0.1, 1.0}) {
      out += fmt::format(
          "<path d=\"M{0} {1:.1f} H{2}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}"
          "</text>\n",
          kLeft, y_of(p), kRight, kLeft - 6, y_of(p) + 4, p);
    }
    return out + fmt::format(
                     "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">cycles per pixel</text>"
                     "<text x=\"{}\" y=\"{}\">power relative to 0.05</text>\n",
                     (kLeft + kRight) / 2, kBottom + 36, kLeft, kTop - 10);
  }

  // From half the minimum to twice the maximum of the real spectra.
  std::string band() const {
    if (real_.empty()) return {};
    std::string up, back;
    for (std::size_t k = 0; k < kFrequencies.size(); ++k) {
      double low = real_[0].power[k], high = low;
      for (const Line& line : real_) {
        low = std::min(low, line.power[k]);
        high = std::max(high, line.power[k]);
      }
      up += fmt::format("{:.1f},{:.1f} ", x_of(kFrequencies[k]), y_of(2 * high));
      back.insert(0, fmt::format("{:.1f},{:.1f} ", x_of(kFrequencies[k]), y_of(0.5 * low)));
    }
    return fmt::format("<polygon points=\"{}{}\" fill=\"#eee\"/>\n", up, back);
  }

  static std::string polyline(const Line& line, const char* colour, const char* width, const char* dashes) {
    std::string points;
    for (std::size_t k = 0; k < kFrequencies.size(); ++k)
      points += fmt::format("{:.1f},{:.1f} ", x_of(kFrequencies[k]), y_of(line.power[k]));
    return fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-dasharray=\"{}\"/>\n", points,
        colour, width, dashes);
  }

  std::string legend() const {
    std::string out;
    int row = 0;
    const auto entry = [&](const std::string& name, const char* colour, const char* dashes) {
      const int y = kTop + 8 + 18 * row++;
      out += fmt::format(
          "<path d=\"M{} {} h28\" stroke=\"{}\" stroke-width=\"2\" stroke-dasharray=\"{}\"/><text x=\"{}\" y=\"{}\">{}"
          "</text>\n",
          kRight + 24, y, colour, dashes, kRight + 58, y + 4, name);
    };
    for (const Line& line : real_) entry(line.name, "#777", "6 4");
    std::size_t i = 0;
    for (const Line& line : simulated_) entry(line.name, kColours[i++ % kColours.size()], "");
    return out;
  }

  std::vector<Line> real_, simulated_;
};

}  // namespace spartan
