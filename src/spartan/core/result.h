// Errors as values: what can fail for outside reasons returns a Result; exceptions are for programming errors.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace spartan {

/// What kind of thing went wrong: what a caller can act on. The program's exit codes follow from it
/// (docs/reference/command_line.md).
enum class ErrorCode {
  internal,        ///< a fault of the program itself
  usage,           ///< the caller asked for something that does not exist
  input,           ///< images or recordings missing, empty, unreadable or of the wrong shape
  frame_rejected,  ///< one stereo frame does not fit the rig; the frames after it may
  store_damaged,   ///< a database, map tile or saved state is damaged; nothing that rests on it can go on
  configuration,   ///< a calibration, rig, option file or scenario is invalid
  output,          ///< something cannot be written
  read_error,      ///< the system cannot read an existing file (EIO, EACCES …); this does not mean that it is damaged
  resources,       ///< memory, file descriptors or disk blocks of the system ran out; the same may succeed later
  interrupted,     ///< the user asked to stop
};

/// An error for people: what happened, where (file, line, key), what to do about it.
struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string what;
  std::string where;  ///< "file:line: key" as far as known; may be empty
  std::string hint;   ///< what to do; may be empty

  /// One line: "where: what (hint)".
  std::string message() const {
    std::string text = where.empty() ? what : where + ": " + what;
    return hint.empty() ? text : text + " (" + hint + ")";
  }
};

template <class T>
using Result = tl::expected<T, Error>;
using Status = Result<void>;

/// `return failure(ErrorCode::input, "the file is empty", path);`
inline tl::unexpected<Error> failure(ErrorCode code, std::string what, std::string where = {}, std::string hint = {}) {
  return tl::unexpected<Error>(Error{code, std::move(what), std::move(where), std::move(hint)});
}

/// Hands the error of one result on as the error of another.
template <class T>
tl::unexpected<Error> failure(Result<T>&& result) {
  return tl::unexpected<Error>(std::move(result).error());
}
template <class T>
tl::unexpected<Error> failure(const Result<T>& result) {
  return tl::unexpected<Error>(result.error());
}

}  // namespace spartan
