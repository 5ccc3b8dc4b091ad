#include "spartan/system/internal/run_identity.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <sstream>
#include <string>

#include "spartan/core/options.h"
#include "spartan/system/run_options.h"

namespace spartan::internal {
namespace {

constexpr const char *kGivenOptions = "given_options", *kGivenRig = "given_rig", *kGivenKeys = "given_keys",
                     *kGroundUp = "ground_up";

Status write_value(Database& db, const std::string& key, const std::string& value) {
  auto insert = db.prepare("INSERT INTO identity VALUES (?, ?)");
  if (!insert) return failure(insert);
  return insert->bind(1, key).bind(2, value).run();
}

// Of a live run.
Status write_given(Database& db, const RunIdentity& identity) {
  if (identity.given_rig.empty()) return {};
  if (Status s = write_value(db, kGivenOptions, identity.given_options); !s) return s;
  if (Status s = write_value(db, kGivenRig, identity.given_rig); !s) return s;
  if (Status s = write_value(db, kGivenKeys, identity.given_keys); !s) return s;
  if (!identity.ground_up) return {};
  const Eigen::Vector3d& up = *identity.ground_up;
  return write_value(db, kGroundUp, fmt::format("{} {} {}", up.x(), up.y(), up.z()));
}

std::optional<Eigen::Vector3d> vector_of(const std::string& text) {
  std::istringstream in(text);
  Eigen::Vector3d vector;
  in >> vector.x() >> vector.y() >> vector.z();
  return in && vector.allFinite() && vector.norm() > 0 ? std::optional(vector) : std::nullopt;
}

Status expect_value(Database& db, const std::string& key, const std::string& value, std::string what) {
  auto select = db.prepare("SELECT value FROM identity WHERE key = ?");
  if (!select) return failure(select);
  select->bind(1, key);
  const auto row = select->step();
  if (!row) return failure(row);
  if (*row && select->text(0) == value) return {};
  if (*row && (key == "options" || key == kGivenOptions)) {
    const auto before = parse_options<RunOptions>(select->text(0), db.path()),
               now = parse_options<RunOptions>(value, key);
    if (before && now) {
      const std::string differences = option_differences(*before, *now);
      if (differences.empty()) return {};  // only descriptions differ
      what += ": " + differences;
    }
  }
  if (*row && key == kGivenKeys) what += fmt::format(": '{}', now '{}'", select->text(0), value);
  return failure(ErrorCode::configuration, "was written by a run with " + what, db.path(),
                 "resume with the same input, rig and options, or run into a new folder");
}

}  // namespace

Status write_identity(Database& db, const RunIdentity& identity) {
  if (Status s = write_value(db, "input", identity.input); !s) return s;
  if (Status s = write_value(db, "options", identity.options); !s) return s;
  if (Status s = write_value(db, "rig", identity.rig); !s) return s;
  return write_given(db, identity);
}

Result<RunIdentity> read_identity(Database& db) {
  std::map<std::string, std::string> values;
  Status read = for_each_row(db, "SELECT key, value FROM identity", [&](const SqlStatement& row) {
    values[row.text(0)] = row.text(1);
    return Status();
  });
  if (!read) return failure(read);
  RunIdentity identity;
  identity.input = values["input"];
  identity.options = values["options"];
  identity.rig = values["rig"];
  identity.given_options = values[kGivenOptions];
  identity.given_rig = values[kGivenRig];
  identity.given_keys = values[kGivenKeys];
  if (!values.contains(kGroundUp)) return identity;
  identity.ground_up = vector_of(values[kGroundUp]);
  if (identity.ground_up) return identity;
  return failure(ErrorCode::store_damaged, "is damaged: table 'identity': 'ground_up' is no direction", db.path(),
                 "run again into a new folder");
}

Status expect_identity(Database& db, const RunIdentity& identity) {
  if (Status s = expect_value(db, "input", identity.input, "another input"); !s) return s;
  if (!identity.given_rig.empty()) {
    if (Status s = expect_value(db, kGivenRig, identity.given_rig, "another rig"); !s) return s;
    if (Status s = expect_value(db, kGivenOptions, identity.given_options, "other options"); !s) return s;
    if (Status s = expect_value(db, kGivenKeys, identity.given_keys, "other options given"); !s) return s;
  }
  if (Status s = expect_value(db, "rig", identity.rig, "another rig"); !s) return s;
  return expect_value(db, "options", identity.options, "other options");
}

}  // namespace spartan::internal
