#include "app/bundle/tar.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>

#include "platform/core/ensure.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kBlock = 512;
constexpr int kGzip = 16;  // added to the window bits, asks zlib for a gzip header (zlib.h, deflateInit2)

/// Octal digits with a zero behind them, as ustar has numbers.
template <std::size_t N>
void put_octal(std::array<char, kBlock>& block, std::size_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < N - 1; ++i) block[at + N - 2 - i] = static_cast<char>('0' + (value >> (3 * i) & 7U));
}

void put_text(std::array<char, kBlock>& block, std::size_t at, std::string_view text) {
  std::ranges::copy(text, block.begin() + static_cast<std::ptrdiff_t>(at));
}

std::array<char, kBlock> header(std::string_view name, std::uint64_t size, std::int64_t modified_s) {
  std::array<char, kBlock> block{};
  put_text(block, 0, name);
  put_octal<8>(block, 100, 0644);
  put_octal<8>(block, 108, 0);
  put_octal<8>(block, 116, 0);
  put_octal<12>(block, 124, size);
  put_octal<12>(block, 136, static_cast<std::uint64_t>(std::max<std::int64_t>(0, modified_s)));
  put_text(block, 148, "        ");  // the sum is computed with spaces in its place
  block[156] = '0';                  // a regular file
  put_text(block, 257, std::string_view("ustar\0", 6));
  put_text(block, 263, "00");
  std::uint64_t sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  put_octal<7>(block, 148, sum);
  block[154] = '\0';
  return block;
}

}  // namespace

struct TarGzWriter::Stream {
  explicit Stream(AtomicFile target) : file(std::move(target)) {}
  ~Stream() {
    if (begun) deflateEnd(&z);
  }
  AtomicFile file;
  z_stream z{};
  bool begun = false;
  std::uint64_t left = 0;     ///< of the file that was begun
  std::uint64_t written = 0;  ///< of it
  std::array<std::byte, 64 * 1024> out;
};

TarGzWriter::TarGzWriter(std::unique_ptr<Stream> stream) : stream_(std::move(stream)) {}
TarGzWriter::TarGzWriter(TarGzWriter&&) noexcept = default;
TarGzWriter::~TarGzWriter() = default;

Result<TarGzWriter> TarGzWriter::create(const std::string& path) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return std::unexpected(file.error());
  auto stream = std::make_unique<Stream>(std::move(*file));
  if (deflateInit2(&stream->z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzip, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
    return failure(Fault::kOutOfMemory, "{}: no memory to compress with", path);
  }
  stream->begun = true;
  return TarGzWriter(std::move(stream));
}

Status TarGzWriter::compress(std::span<const std::byte> bytes, bool last) {
  z_stream& z = stream_->z;
  z.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));  // zlib does not write there
  z.avail_in = static_cast<uInt>(bytes.size());
  int result = Z_OK;
  do {
    z.next_out = reinterpret_cast<Bytef*>(stream_->out.data());
    z.avail_out = static_cast<uInt>(stream_->out.size());
    result = deflate(&z, last ? Z_FINISH : Z_NO_FLUSH);
    const std::size_t made = stream_->out.size() - z.avail_out;
    if (const Status status = stream_->file.write(std::span(stream_->out).first(made)); !status) return status;
  } while (z.avail_out == 0 || (last && result != Z_STREAM_END));
  return {};
}

Status TarGzWriter::pad() {
  static constexpr std::array<std::byte, kBlock> kZeros{};
  const std::size_t over = stream_->written % kBlock;
  return over == 0 ? Status{} : compress(std::span(kZeros).first(kBlock - over), false);
}

Status TarGzWriter::begin(std::string_view name, std::uint64_t size, std::int64_t modified_s) {
  ENSURE(7801, stream_->left == 0);
  if (name.empty() || name.size() > kTarNameMax) return failure(Fault::kUsage, "{:.60}: the name is too long", name);
  if (const Status status = pad(); !status) return status;
  const auto block = header(name, size, modified_s);
  stream_->left = size;
  stream_->written = 0;
  return compress(std::as_bytes(std::span(block)), false);
}

Status TarGzWriter::write(std::span<const std::byte> bytes) {
  ENSURE(7802, bytes.size() <= stream_->left);
  stream_->left -= bytes.size();
  stream_->written += bytes.size();
  return compress(bytes, false);
}

Status TarGzWriter::add(std::string_view name, std::string_view text, std::int64_t modified_s) {
  if (const Status status = begin(name, text.size(), modified_s); !status) return status;
  return write(std::as_bytes(std::span(text)));
}

Status TarGzWriter::commit() {
  ENSURE(7803, stream_->left == 0);
  if (const Status status = pad(); !status) return status;
  static constexpr std::array<std::byte, 2 * kBlock> kEnd{};
  if (const Status status = compress(kEnd, true); !status) return status;
  return stream_->file.commit();
}

}  // namespace firstlook
