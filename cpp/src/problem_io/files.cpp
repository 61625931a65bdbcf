#include "problem_io/files.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "energymargin/problem_io.hpp"

namespace energymargin::problem_io {
namespace {

std::string part(const File& file) { return file.path + ".part"; }

[[noreturn]] void fail(const std::string& what, int error) { throw FileError(what + ": " + std::strerror(error)); }

[[noreturn]] void fail_to_write(const File& file) { fail("cannot write '" + file.path + "'", errno); }

void write_part(const File& file) {
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

void take_place(const File& file) {
  if (std::rename(part(file).c_str(), file.path.c_str()) != 0) fail_to_write(file);
}

}  // namespace

std::string read_file(const std::string& what, const std::string& path) {
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

void write_files(const std::vector<File>& files) {
  std::size_t written = 0;
  try {
    for (; written < files.size(); ++written) write_part(files[written]);
    for (const File& file : files) take_place(file);
  } catch (const FileError&) {
    for (std::size_t i = 0; i < written; ++i) std::remove(part(files[i]).c_str());
    throw;
  }
}

}  // namespace energymargin::problem_io
