// Helpers for tests of file readers: corrupt a valid text, and get the error message.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "spartan/core/result.h"

namespace spartan::testing {

/// The text with the first occurrence of `what` replaced; fails the test where there is none.
inline std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

/// The message of an error, whose code must be `configuration`; "nothing" if the result has a value.
template <class T>
std::string error_message(const Result<T>& read) {
  if (read) return "nothing";
  EXPECT_EQ(read.error().code, ErrorCode::configuration);
  return read.error().message();
}

}  // namespace spartan::testing
