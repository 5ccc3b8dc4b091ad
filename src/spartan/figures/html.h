// Text, images and tables of a self-contained HTML page.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/image.h"

namespace spartan {

/// Escapes the characters that are special in HTML.
std::string html_text(const std::string& text);

/// The bytes in base64 (RFC 4648).
std::string base64(const std::string& bytes);

/// "data:image/png;base64,…"; of no bytes where the image cannot be encoded.
std::string data_url(ImageView<const Rgb8> image);

/// A figure of an image, embedded as PNG, with a caption; the style of the page gives it its width. `below`: HTML under
/// the image.
std::string html_image(ImageView<const std::uint8_t> image, const std::string& caption, const std::string& below = "");
std::string html_image(ImageView<const Rgb8> image, const std::string& caption, const std::string& below = "");

/// A table whose first row is the header. It can be scrolled sideways where it is wider than the page.
std::string html_table(const std::string& caption, const std::vector<std::vector<std::string>>& rows);

/// Reduces an image by block means to at most `width` columns.
Image<std::uint8_t> shrunk(ImageView<const std::uint8_t> image, int width);
Image<Rgb8> shrunk(ImageView<const Rgb8> image, int width);

}  // namespace spartan
