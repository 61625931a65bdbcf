#pragma once
// Files, read whole, and written all or none.

#include <string>
#include <vector>

namespace energymargin::problem_io {

//! The content of a file. Throws FileError that says `what` it is, names it, and tells why it cannot be read.
std::string read_file(const std::string& what, const std::string& path);

struct File {
  std::string path;
  std::string text;
};

//! Writes each file beside its place first; once all are written they take their places, in this order. Throws
//! FileError that names the file that cannot be written.
void write_files(const std::vector<File>& files);

}  // namespace energymargin::problem_io
