#include "app/dataset/tum_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>

namespace firstlook {

Result<std::vector<TumLine>> read_tum_lines(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file))
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  std::vector<TumLine> lines;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    TumLine line{number, {}};
    std::string_view rest = text;
    while (true) {
      const std::size_t from = rest.find_first_not_of(" \t\r");
      if (from == std::string_view::npos) break;
      rest.remove_prefix(from);
      const std::size_t to = std::min(rest.find_first_of(" \t\r"), rest.size());
      line.words.emplace_back(rest.substr(0, to));
      rest.remove_prefix(to);
    }
    if (!line.words.empty() && line.words.front().front() != '#') lines.push_back(std::move(line));
  }
  return lines;
}

std::optional<double> to_number(const std::string& word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

StampedImage read_stamped_image(const TumLine& line, const std::filesystem::path& folder) {
  StampedImage image{line.number, to_number(line.words[0]).value_or(std::nan("")), {}, {}};
  if (line.words.size() > 1) image.image = line.words[1];
  if (line.words.size() != 2)
    image.fault = fmt::format("{} columns instead of 'timestamp filename'", line.words.size());
  else if (!std::isfinite(image.stamp_s))
    image.fault = fmt::format("'{}' is not a finite number", line.words[0]);
  else if (image.stamp_s < 0)
    image.fault = "negative time stamp";
  else if (!std::filesystem::is_regular_file(folder / image.image))
    image.fault = fmt::format("{}: no such file", image.image);
  return image;
}

}  // namespace firstlook
