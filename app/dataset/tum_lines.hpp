/// The text files of the TUM RGB-D layout: columns between white space, comments behind #.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

/// A line that is neither empty nor a comment.
struct TumLine {
  int number = 0;  ///< in the file, from 1 on
  std::vector<std::string> words;
};

/// Error: kDataMissing.
[[nodiscard]] Result<std::vector<TumLine>> read_tum_lines(const std::filesystem::path& file);

/// A finite number and nothing else.
[[nodiscard]] std::optional<double> to_number(const std::string& word);

/// "timestamp filename", as depth.txt and rgb.txt have them, as far as it can be read.
struct StampedImage {
  int line = 0;
  double stamp_s = 0;  ///< NaN when it could not be read
  std::string image;   ///< as the file has it
  std::string fault;   ///< empty, or what is wrong: columns, stamp, no such file in `folder`
};
[[nodiscard]] StampedImage read_stamped_image(const TumLine& line, const std::filesystem::path& folder);

}  // namespace firstlook
