// Conversion between cv::Mat and image views without copying. The only public header that includes OpenCV.
#pragma once

#include <opencv2/core/mat.hpp>

#include "spartan/core/image.h"

namespace spartan {

namespace opencv_detail {
template <class T>
struct MatType;
template <>
struct MatType<std::uint8_t> {
  static constexpr int value = CV_8UC1;
};
template <>
struct MatType<std::uint16_t> {
  static constexpr int value = CV_16UC1;
};
template <>
struct MatType<std::int16_t> {
  static constexpr int value = CV_16SC1;
};
template <>
struct MatType<float> {
  static constexpr int value = CV_32FC1;
};
template <>
struct MatType<Rgb8> {
  static constexpr int value = CV_8UC3;
};
template <>
struct MatType<Rgb16> {
  static constexpr int value = CV_16UC3;
};
}  // namespace opencv_detail

/// A cv::Mat header that refers to the view's memory. The channel order is unchanged (Rgb8: R, G, B; OpenCV's own
/// functions expect B, G, R). Constness of the pixels is lost.
template <class T>
cv::Mat as_mat(ImageView<T> view) {
  using Pixel = std::remove_const_t<T>;
  return cv::Mat(view.height(), view.width(), opencv_detail::MatType<Pixel>::value, const_cast<Pixel*>(view.data()),
                 static_cast<std::size_t>(view.stride()) * sizeof(Pixel));
}
template <class T>
cv::Mat as_mat(Image<T>& image) {
  return as_mat(image.view());
}
template <class T>
cv::Mat as_mat(const Image<T>& image) {
  return as_mat(image.view());
}

/// A view of the matrix's memory; throws std::invalid_argument if the element type differs.
template <class T>
ImageView<T> as_view(cv::Mat& mat) {
  if (mat.type() != opencv_detail::MatType<T>::value) throw std::invalid_argument("as_view: the element type differs");
  return {mat.ptr<T>(), mat.cols, mat.rows, static_cast<std::ptrdiff_t>(mat.step / sizeof(T))};
}
template <class T>
ImageView<const T> as_view(const cv::Mat& mat) {
  if (mat.type() != opencv_detail::MatType<T>::value) throw std::invalid_argument("as_view: the element type differs");
  return {mat.ptr<T>(), mat.cols, mat.rows, static_cast<std::ptrdiff_t>(mat.step / sizeof(T))};
}

}  // namespace spartan
