#include "platform/journal/journal.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

#include "platform/linux/files.hpp"
#include "platform/memory/allocation_guard.hpp"

using namespace firstlook;

namespace {

const JournalHeader kNoHeader{};

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::byte> small_journal() {
  auto writer = JournalWriter::create_memory({.program_version = "0.1.0", .config = "seed: 7\n"}, 4096);
  REQUIRE(writer);
  (*writer)->event(16, Instant{1000}, bytes_of("joint state"));
  (*writer)->decision(1, Instant{1000}, bytes_of("move"));
  (*writer)->note(9, Instant{1500}, {});
  (*writer)->event(17, Instant{2000}, bytes_of("frame"));
  (*writer)->decision(2, Instant{2000}, bytes_of("stop"));
  REQUIRE((*writer)->close(Instant{3000}));
  const auto bytes = (*writer)->memory();
  return {bytes.begin(), bytes.end()};
}

/// The error that reading to the end meets, if any.
Status read_all(std::vector<std::byte> bytes) {
  auto reader = JournalReader::from_bytes(std::move(bytes));
  if (!reader) return std::unexpected(reader.error());
  for (int i = 0; i < 10'000; ++i) {
    const auto record = reader->next();
    if (!record) return std::unexpected(record.error());
    if (!*record) return {};
  }
  FAIL("no end");
  return {};
}

struct TemporaryFolder {
  TemporaryFolder() : path(std::filesystem::temp_directory_path() / ("firstlook_journal_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

}  // namespace

TEST_CASE("CRC-32 and FNV-1a give their published values") {
  CHECK(crc32(0, bytes_of("123456789")) == 0xcbf43926U);
  CHECK(crc32(crc32(0, bytes_of("1234")), bytes_of("56789")) == 0xcbf43926U);
  Fnv1a hash;
  CHECK(hash.value() == 0xcbf29ce484222325ULL);
  hash.add(bytes_of("foobar"));
  CHECK(hash.value() == 0x85944171f73967e8ULL);
  CHECK(hash_text(0xabc) == "0000000000000abc");
}

TEST_CASE("an event that is held is recorded before what is decided, and not at all when nothing is") {
  auto writer = JournalWriter::create_memory(kNoHeader, 4096);
  REQUIRE(writer);
  JournalWriter& w = **writer;
  for (int i = 0; i < 100; ++i) {
    w.hold(16, Instant{i}, bytes_of("report " + std::to_string(i)), true);
    w.hold(17, Instant{i}, bytes_of("color"), false);
    w.hold(18, Instant{i}, bytes_of("depth"), false);
  }
  CHECK(w.records() == 0);
  w.decision(1, Instant{99}, bytes_of("stop"));
  w.decision(2, Instant{99}, bytes_of("light"));
  w.hold(18, Instant{100}, bytes_of("depth"), false);
  w.event(19, Instant{101}, bytes_of("key"));
  w.hold(16, Instant{102}, bytes_of("report"), true);
  REQUIRE(w.close(Instant{103}));
  auto reader = JournalReader::from_bytes({w.memory().begin(), w.memory().end()});
  REQUIRE(reader);
  std::vector<std::pair<std::int64_t, std::string>> found;
  for (auto record = reader->next(); record && *record; record = reader->next())
    found.emplace_back((*record)->time.ns, text_of((*record)->payload));
  CHECK(found == std::vector<std::pair<std::int64_t, std::string>>{
                     {99, "report 99"}, {99, "depth"}, {99, "stop"}, {99, "light"}, {100, "depth"}, {101, "key"}});
  CHECK(reader->decisions_hash() == w.decisions_hash());
}

TEST_CASE("records come back in order with their bytes, and the end gives the hash of the decisions") {
  auto reader = JournalReader::from_bytes(small_journal());
  REQUIRE(reader);
  CHECK(reader->header().program_version == "0.1.0");
  CHECK(reader->header().config == "seed: 7\n");
  const std::vector<std::tuple<RecordType, int, std::int64_t, std::string>> expected = {
      {RecordType::kEvent, 16, 1000, "joint state"},
      {RecordType::kDecision, 1, 1000, "move"},
      {RecordType::kNote, 9, 1500, ""},
      {RecordType::kEvent, 17, 2000, "frame"},
      {RecordType::kDecision, 2, 2000, "stop"}};
  DecisionsHash hash;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto record = reader->next();
    REQUIRE(record);
    REQUIRE(*record);
    const JournalRecord& r = **record;
    CHECK(r.number == i);
    CHECK(std::tuple(r.type, static_cast<int>(r.kind), r.time.ns, text_of(r.payload)) == expected[i]);
    if (r.type == RecordType::kDecision) hash.add(r.kind, r.time, r.payload);
  }
  CHECK_FALSE(reader->decisions_hash());
  const auto end = reader->next();
  REQUIRE(end);
  CHECK_FALSE(*end);
  CHECK(reader->decisions_hash() == hash.value());
  CHECK_FALSE(*reader->next());
}

TEST_CASE("the hash of decisions depends on order, time, kind and bytes") {
  const auto hash = [](std::uint16_t kind, std::int64_t time, std::string_view a, std::string_view b) {
    DecisionsHash h;
    h.add(kind, Instant{time}, bytes_of(a));
    h.add(kind, Instant{time}, bytes_of(b));
    return h.value();
  };
  const std::uint64_t reference = hash(1, 5, "ab", "c");
  CHECK(hash(1, 5, "ab", "c") == reference);
  CHECK(hash(2, 5, "ab", "c") != reference);
  CHECK(hash(1, 6, "ab", "c") != reference);
  CHECK(hash(1, 5, "a", "bc") != reference);
  CHECK(hash(1, 5, "c", "ab") != reference);
}

TEST_CASE("a journal cut short at any byte is found out") {
  const std::vector<std::byte> whole = small_journal();
  REQUIRE(read_all(whole));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Status status = read_all({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    REQUIRE_FALSE(status);
    CHECK(status.error().fault == Fault::kJournalBroken);
    CHECK(status.error().detail().find("byte ") == 0);
  }
}

TEST_CASE("any flipped bit of any byte is found out") {
  const std::vector<std::byte> whole = small_journal();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::vector<std::byte> altered = whole;
      altered[at] ^= std::byte{1} << bit;
      const Status status = read_all(altered);
      REQUIRE_FALSE(status);
      CHECK(status.error().fault == Fault::kJournalBroken);
    }
  }
}

TEST_CASE("a record taken out, one doubled, and bytes behind the end are found out") {
  const std::vector<std::byte> whole = small_journal();
  const std::size_t head = 8 + 12 + 5 + 8 + 4;
  const std::size_t first = 19 + 11;  // "joint state"
  std::vector<std::byte> missing = whole;
  const auto begin = missing.begin() + static_cast<std::ptrdiff_t>(head);
  missing.erase(begin, begin + static_cast<std::ptrdiff_t>(first));
  const Status status = read_all(missing);
  REQUIRE_FALSE(status);
  CHECK(status.error().detail() == fmt::format("byte {}: record 0 was altered, or one before it is missing", head));
  std::vector<std::byte> doubled = whole;
  doubled.insert(doubled.begin() + static_cast<std::ptrdiff_t>(head + first),
                 whole.begin() + static_cast<std::ptrdiff_t>(head),
                 whole.begin() + static_cast<std::ptrdiff_t>(head + first));
  CHECK_FALSE(read_all(doubled));
  std::vector<std::byte> longer = whole;
  longer.push_back(std::byte{0});
  CHECK_FALSE(read_all(longer));
}

TEST_CASE("a journal from a program that died is read up to where it ends, then reported") {
  auto writer = JournalWriter::create_memory(kNoHeader, 4096);
  REQUIRE(writer);
  (*writer)->event(16, Instant{1}, bytes_of("last words"));
  REQUIRE((*writer)->flush());
  const auto bytes = (*writer)->memory();
  auto reader = JournalReader::from_bytes({bytes.begin(), bytes.end()});
  REQUIRE(reader);
  CHECK(*reader->next());
  const auto end = reader->next();
  REQUIRE_FALSE(end);
  CHECK(end.error().detail() == fmt::format("byte {}: cut short in record 1", bytes.size()));
}

TEST_CASE("at the cap the recording stops and says so, the journal stays valid and the hash goes on") {
  constexpr std::size_t kCap = 1000;
  auto writer = JournalWriter::create_memory(kNoHeader, kCap);
  REQUIRE(writer);
  DecisionsHash hash;
  for (int i = 0; i < 100; ++i) {
    (*writer)->decision(1, Instant{i}, bytes_of("twenty bytes of this"));
    hash.add(1, Instant{i}, bytes_of("twenty bytes of this"));
  }
  CHECK_FALSE((*writer)->recording());
  REQUIRE((*writer)->close(Instant{100}));
  CHECK((*writer)->memory().size() <= kCap);
  CHECK((*writer)->memory().size() > kCap - 60);
  const auto bytes = (*writer)->memory();
  auto reader = JournalReader::from_bytes({bytes.begin(), bytes.end()});
  REQUIRE(reader);
  JournalRecord last;
  while (true) {
    const auto record = reader->next();
    REQUIRE(record);
    if (!*record) break;
    last = **record;
  }
  CHECK(last.type == RecordType::kNote);
  CHECK(last.kind == kNoteRecordingStopped);
  CHECK(reader->decisions_hash() == hash.value());
  CHECK_FALSE(JournalWriter::create_memory({.program_version = "", .config = std::string(200, 'x')}, 200));
}

TEST_CASE("a file holds the same bytes as memory, and recording to it does not allocate") {
  const TemporaryFolder folder;
  const std::string path = (folder.path / "journal.flj").string();
  const std::string large(3000, 'x');
  const auto fill = [&](JournalWriter& writer) {
    memory::seal();
    for (int i = 0; i < 500; ++i) {
      writer.event(16, Instant{i}, bytes_of(large));
      writer.decision(1, Instant{i}, bytes_of("go on"));
    }
    const std::uint64_t allocations = memory::loop_allocations_after_seal();
    memory::unseal();
    CHECK(allocations == 0);
    REQUIRE(writer.close(Instant{500}));
  };
  auto to_file = JournalWriter::create_file(path, {"1", "a: b"});
  REQUIRE(to_file);
  fill(**to_file);
  auto to_memory = JournalWriter::create_memory({"1", "a: b"}, 4 << 20);
  REQUIRE(to_memory);
  fill(**to_memory);
  CHECK((*to_file)->decisions_hash() == (*to_memory)->decisions_hash());
  const auto file = read_file(path, 8 << 20);
  REQUIRE(file);
  CHECK(std::ranges::equal(*file, (*to_memory)->memory()));
  CHECK(read_all(*file));
  CHECK(JournalReader::open(path));
}

TEST_CASE("a full disk becomes a status, recording stops, the hash goes on") {
  const auto no_header = JournalWriter::create_file("/dev/full", kNoHeader);
  REQUIRE_FALSE(no_header);
  CHECK(no_header.error().fault == Fault::kDiskWrite);
  CHECK_FALSE(JournalWriter::create_file("/nowhere/at/all.flj", kNoHeader));

  // A pipe whose reader is gone takes the head and fails later, as a disk does that becomes full.
  const TemporaryFolder folder;
  const std::string path = (folder.path / "pipe").string();
  REQUIRE(mkfifo(path.c_str(), 0600) == 0);
  const int reader = open(path.c_str(), O_RDONLY | O_NONBLOCK);
  REQUIRE(reader >= 0);
  auto writer = JournalWriter::create_file(path, kNoHeader);
  REQUIRE(writer);
  close(reader);
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  (*writer)->decision(1, Instant{1}, bytes_of("a"));
  CHECK((*writer)->recording());
  CHECK_FALSE((*writer)->flush());
  CHECK_FALSE((*writer)->recording());
  const std::uint64_t hash = (*writer)->decisions_hash();
  (*writer)->decision(1, Instant{2}, bytes_of("b"));
  CHECK((*writer)->decisions_hash() != hash);
  const Status closed = (*writer)->close(Instant{3});
  REQUIRE_FALSE(closed);
  CHECK(closed.error().fault == Fault::kDiskWrite);
  std::signal(SIGPIPE, before);
}

TEST_CASE("what is no journal is refused with a reason") {
  const TemporaryFolder folder;
  const auto missing = JournalReader::open((folder.path / "none.flj").string());
  REQUIRE_FALSE(missing);
  CHECK(missing.error().fault == Fault::kDataMissing);
  const auto text = JournalReader::from_bytes(std::vector<std::byte>(100, std::byte{'x'}));
  REQUIRE_FALSE(text);
  CHECK(text.error().detail() == "byte 0: not a journal of firstlook");
  CHECK_FALSE(JournalReader::from_bytes({}));
}
