// The trace of all changes of files below a folder, from which power_loss.py derives what a disk may hold.
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <cstdint>
#include <cstdio>

namespace spartan::faults {

// Trace: a record is a header, two paths and the bytes.
enum class Change : std::uint32_t { create = 1, write, truncate, sync, rename, unlink, mkdir, sync_folder, content };
struct Header {
  Change change;
  std::uint32_t path_bytes, second_path_bytes, data_bytes;
  std::uint64_t inode;
  std::int64_t offset;
};
bool exists(const char* path);
bool traced(const char* path);
void trace(Change change, const char* path, const char* second, std::uint64_t inode, std::int64_t offset,
           const void* data, std::size_t bytes);
void trace_write(int file, const void* data, ssize_t written, std::int64_t offset);
void trace_simple(int file, Change change, std::int64_t offset = 0);
void trace_opened(int file, bool existed, bool truncated);
// The content of a file that stdio wrote.
void trace_content(FILE* stream);

struct stat status_of(int file);

}  // namespace spartan::faults
