/// Values as bytes and back: little-endian, without padding, one list of fields for both directions.
///
///   struct Leg {
///     JointVector target_rad;
///     double speed_rad_s = 0;
///     template <typename Archive> void fields(Archive& a) { a(target_rad, speed_rad_s); }
///   };
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/time.hpp"

namespace firstlook {

static_assert(std::endian::native == std::endian::little, "the bytes of the journal are little-endian");

/// Numbers that go to the bytes as they are.
template <typename T>
concept ArchiveNumber =
    (std::integral<T> && !std::same_as<T, bool>) || std::same_as<T, double> || std::same_as<T, float>;

/// A type with `template <class A> void fields(A& a) { a(x, y, z); }`.
template <typename T, typename Archive>
concept HasFields = requires(T& value, Archive& archive) { value.fields(archive); };

/// Writes into a span; stops at its end and then is not ok().
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t size() const { return size_; }

  template <typename... Ts>
  void operator()(const Ts&... values) {
    (write(values), ...);
  }

  void raw(const void* data, std::size_t size) {
    if (!ok_ || size > bytes_.size() - size_) {
      ok_ = false;
      return;
    }
    if (size != 0) std::memcpy(bytes_.data() + size_, data, size);
    size_ += size;
  }

 private:
  template <ArchiveNumber T>
  void write(T value) {
    raw(&value, sizeof value);
  }
  void write(bool value) { write(static_cast<std::uint8_t>(value ? 1 : 0)); }
  template <typename T>
    requires std::is_enum_v<T>
  void write(T value) {
    write(static_cast<std::underlying_type_t<T>>(value));
  }
  void write(Instant value) { write(value.ns); }
  void write(Duration value) { write(value.ns); }
  void write(const JointVector& q) {
    if (q.count < 0 || q.count > kJointsMax) {
      ok_ = false;
      return;
    }
    write(static_cast<std::uint8_t>(q.count));
    for (int i = 0; i < q.count; ++i) write(q[i]);
  }
  template <typename T, std::size_t N>
  void write(const std::array<T, N>& items) {
    for (const T& item : items) write(item);
  }
  template <typename T, std::size_t N>
  void write(const FixedVector<T, N>& items) {
    write(static_cast<std::uint32_t>(items.size()));
    for (const T& item : items) write(item);
  }
  template <typename T>
    requires std::is_class_v<T> && HasFields<T, ByteWriter>
  void write(const T& value) {
    const_cast<T&>(value).fields(*this);  // one list of fields for both directions; this one only reads them
  }

  std::span<std::byte> bytes_;
  std::size_t size_ = 0;
  bool ok_ = true;
};

/// Reads from a span; after its end, or at a value that cannot be (a bool of 2, a vector longer than its capacity), it
/// is not ok() and leaves the rest of the values as they were.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - at_; }

  template <typename... Ts>
  void operator()(Ts&... values) {
    (read(values), ...);
  }

  void raw(void* data, std::size_t size) {
    if (!ok_ || size > remaining()) {
      ok_ = false;
      return;
    }
    if (size != 0) std::memcpy(data, bytes_.data() + at_, size);
    at_ += size;
  }

 private:
  template <ArchiveNumber T>
  void read(T& value) {
    raw(&value, sizeof value);
  }
  void read(bool& value) {
    std::uint8_t byte = 0;
    read(byte);
    if (byte > 1) ok_ = false;
    if (ok_) value = byte == 1;
  }
  template <typename T>
    requires std::is_enum_v<T>
  void read(T& value) {
    auto number = static_cast<std::underlying_type_t<T>>(value);
    read(number);
    value = static_cast<T>(number);
  }
  void read(Instant& value) { read(value.ns); }
  void read(Duration& value) { read(value.ns); }
  void read(JointVector& q) {
    std::uint8_t count = 0;
    read(count);
    if (count > kJointsMax) ok_ = false;
    if (!ok_) return;
    q = JointVector::zero(count);
    for (int i = 0; i < q.count; ++i) read(q[i]);
  }
  template <typename T, std::size_t N>
  void read(std::array<T, N>& items) {
    for (T& item : items) read(item);
  }
  template <typename T, std::size_t N>
  void read(FixedVector<T, N>& items) {
    std::uint32_t count = 0;
    read(count);
    if (count > N) ok_ = false;
    if (!ok_) return;
    items.clear();
    items.resize(count);
    for (T& item : items) read(item);
  }
  template <typename T>
    requires std::is_class_v<T> && HasFields<T, ByteReader>
  void read(T& value) {
    value.fields(*this);
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// Writes a value to the front of `bytes` and returns how many bytes it took; 0 when it does not fit or is not valid,
/// and for a type without fields.
template <typename T>
[[nodiscard]] std::size_t pack(const T& value, std::span<std::byte> bytes) {
  ByteWriter writer(bytes);
  writer(value);
  return writer.ok() ? writer.size() : 0;
}

/// Reads a value that fills `bytes` exactly; false when it does not, and then `value` is partly written.
template <typename T>
[[nodiscard]] bool unpack(std::span<const std::byte> bytes, T& value) {
  ByteReader reader(bytes);
  reader(value);
  return reader.ok() && reader.remaining() == 0;
}

}  // namespace firstlook
