#pragma once
// Files, read whole, and written all or none.

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "energymargin/problem_io.hpp"

namespace energymargin::problem_io {

struct File {
  std::string path, text;
};

inline std::string part(const File& file) { return file.path + ".part"; }

[[noreturn]] inline void fail(const std::string& what, int error) {
  throw FileError(what + ": " + std::strerror(error));
}

[[noreturn]] inline void fail_to_write(const File& file) { fail("cannot write '" + file.path + "'", errno); }

inline void write_part(const File& file) {
  errno = 0;
  std::ofstream stream(part(file), std::ios::binary);
  if (!stream) fail_to_write(file);
  stream << file.text << std::flush;
  if (stream) return;
  const int error = errno;
  std::remove(part(file).c_str());
  errno = error;
  fail_to_write(file);
}

//! The content of a file. Throws FileError that says `what` it is, names it, and tells why it cannot be read.
inline std::string read_file(const std::string& what, const std::string& path) {
  const std::string name = what + " '" + path + "'";
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) fail(name + " cannot be opened", EISDIR);
  errno = 0;
  const std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(name + " cannot be opened", errno);
  std::ostringstream text;
  text << stream.rdbuf();
  if (stream.bad()) fail(name + " cannot be read", errno);
  return text.str();
}

//! Writes each file beside its place, and then puts all there. Throws FileError that names what cannot be written.
inline void write_files(const std::vector<File>& files) {
  std::size_t written = 0;
  try {
    for (; written < files.size(); ++written) write_part(files[written]);
    for (const File& file : files) {
      if (std::rename(part(file).c_str(), file.path.c_str()) != 0) fail_to_write(file);
    }
  } catch (const FileError&) {
    for (std::size_t i = 0; i < written; ++i) std::remove(part(files[i]).c_str());
    throw;
  }
}

}  // namespace energymargin::problem_io
