#include "spartan/figures/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spartan/core/result.h"
#include "spartan/image_io/image_io.h"

namespace spartan {

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(bytes.size() * 4 / 3 + 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[k])) : 0U;
    };
    const unsigned block = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    text += kDigits[block >> 18U & 63U];
    text += kDigits[block >> 12U & 63U];
    text += i + 1 < bytes.size() ? kDigits[block >> 6U & 63U] : '=';
    text += i + 2 < bytes.size() ? kDigits[block & 63U] : '=';
  }
  return text;
}

namespace {

std::string url_of(const Result<std::string>& png) {
  return "data:image/png;base64," + (png ? base64(*png) : std::string());
}

template <typename Pixel>
std::string figure(ImageView<const Pixel> image, const std::string& caption, const std::string& below) {
  return fmt::format(
      "<figure class=\"image\"><img alt=\"{0}\" width=\"{1}\" height=\"{2}\" src=\"{3}\">{4}"
      "<figcaption>{0}</figcaption></figure>\n",
      html_text(caption), image.width(), image.height(), url_of(encode_png(image)), below);
}

template <class Pixel, class Sum>
Image<Pixel> shrink(ImageView<const Pixel> image, int width, const Sum& mean_of) {
  const int block = std::max(1, (image.width() + width - 1) / width);
  Image<Pixel> small(image.width() / block, image.height() / block);
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) small(x, y) = mean_of(image.crop(x * block, y * block, block, block));
  }
  return small;
}

}  // namespace

std::string html_text(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string data_url(ImageView<const Rgb8> image) {
  return url_of(encode_png(image));
}

std::string html_image(ImageView<const std::uint8_t> image, const std::string& caption, const std::string& below) {
  return figure(image, caption, below);
}
std::string html_image(ImageView<const Rgb8> image, const std::string& caption, const std::string& below) {
  return figure(image, caption, below);
}

std::string html_table(const std::string& caption, const std::vector<std::vector<std::string>>& rows) {
  std::string table = fmt::format(
      "<div class=\"table\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table>"
      "<caption>{0}</caption>\n",
      html_text(caption));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    table += "<tr>";
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      const char* const tag = i == 0 ? "th scope=\"col\"" : k == 0 ? "th scope=\"row\"" : "td";
      table += fmt::format("<{}>{}</{}>", tag, html_text(rows[i][k]), i == 0 || k == 0 ? "th" : "td");
    }
    table += "</tr>\n";
  }
  return table + "</table></div>\n";
}

Image<std::uint8_t> shrunk(ImageView<const std::uint8_t> image, int width) {
  return shrink(image, width, [](ImageView<const std::uint8_t> block) {
    int sum = 0;
    for (int y = 0; y < block.height(); ++y) {
      for (int x = 0; x < block.width(); ++x) sum += block(x, y);
    }
    return static_cast<std::uint8_t>(sum / (block.width() * block.height()));
  });
}

Image<Rgb8> shrunk(ImageView<const Rgb8> image, int width) {
  return shrink(image, width, [](ImageView<const Rgb8> block) {
    std::array<int, 3> sum{};
    const int count = block.width() * block.height();
    for (int y = 0; y < block.height(); ++y) {
      for (int x = 0; x < block.width(); ++x) {
        sum[0] += block(x, y).r;
        sum[1] += block(x, y).g;
        sum[2] += block(x, y).b;
      }
    }
    return Rgb8{static_cast<std::uint8_t>(sum[0] / count), static_cast<std::uint8_t>(sum[1] / count),
                static_cast<std::uint8_t>(sum[2] / count)};
  });
}

}  // namespace spartan
