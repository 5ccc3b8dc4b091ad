// Publishes lines of text to other processes while a run goes on: standard output, a FIFO, or a TCP port.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::program {

/// A thread writes the lines, so that a slow or stalled reader never delays the caller: what exceeds kMostPending is
/// discarded (standard output, FIFO) or the reader is disconnected (TCP). Readers that come late get the lines from
/// then on.
class Publisher {
 public:
  /// `target`: "-" (standard output), "tcp:PORT" (loopback), "tcp:ADDRESS:PORT", or the path of a FIFO. Codes: `usage`
  /// (not such a target), `output` (cannot be opened).
  static Result<std::unique_ptr<Publisher>> open(const std::string& target);
  /// Writes what is pending for at most half a second.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// `line` without its end.
  void publish(const std::string& line);
  /// Lines that no reader got because it was too slow.
  std::int64_t discarded() const { return discarded_; }
  /// Of a TCP target, the port that it listens to (for port 0, the one that the system chose).
  int port() const { return port_; }

  static constexpr std::size_t kMostPending = std::size_t{1} << 20U;  ///< bytes for each reader

 private:
  struct Reader {
    int file = -1;
    std::string pending;
  };
  Publisher() = default;
  Status open_fifo(const std::string& path);
  Status listen_on(const std::string& address);
  void run();
  void connect();
  void append(const std::string& lines, std::int64_t count);
  void write_pending(int timeout_ms);
  void close_reader(std::size_t index);

  std::string fifo_;   // path; empty: another kind
  int listener_ = -1;  // socket
  int port_ = 0;
  bool is_tcp_ = false;
  std::vector<Reader> readers_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> lines_;
  bool ended_ = false;
  std::atomic<std::int64_t> discarded_ = 0;
  std::thread thread_;
};

}  // namespace spartan::program
