#include "acquire/journal.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::acquire {
namespace {

JournalEntry EntryOf(std::int64_t number) {
  JournalEntry entry;
  entry.number = number;
  entry.picture = {.target = Target::kSample,
                   .pose = 0,
                   .channel = 1,
                   .group = 3,
                   .repeat = 0,
                   .exposure_us = 1000.5};
  entry.spots = {{1, 2}, {30, 40}};
  entry.exposure_us = 1000.25;
  entry.file = "frames/000007.pgm";
  entry.hash = "0123456789abcdef0123456789abcdef";
  entry.frame_id = 1234567890123456789ULL;
  entry.timestamp_ns = -5;
  return entry;
}

std::string ThreeLines() {
  return FormatJournalLine(EntryOf(0)) + FormatJournalLine(EntryOf(1)) +
         FormatJournalLine(EntryOf(2));
}

TEST(Journal, RoundTripKeepsEverything) {
  const Journal journal = ParseJournal(FormatJournalLine(EntryOf(0)), "journal");
  ASSERT_EQ(journal.entries.size(), 1U);
  EXPECT_EQ(FormatJournalLine(journal.entries[0]), FormatJournalLine(EntryOf(0)));
  const JournalEntry& entry = journal.entries[0];
  EXPECT_EQ(entry.picture.target, Target::kSample);
  EXPECT_EQ(entry.picture.channel, 1);
  EXPECT_EQ(entry.picture.exposure_us, 1000.5);
  EXPECT_EQ(entry.spots, (std::vector<GridIndex>{{1, 2}, {30, 40}}));
  EXPECT_EQ(entry.exposure_us, 1000.25);
  EXPECT_EQ(entry.frame_id, 1234567890123456789ULL);
  EXPECT_EQ(entry.timestamp_ns, -5);
}

TEST(Journal, RecordsWhatTheCameraTold) {
  JournalEntry entry = EntryOf(0);
  entry.attempts = 3;
  entry.resent_packets = 12;
  entry.gain = 1.5;
  entry.temperature_c = 40.25;
  entry.largest = 4095;
  entry.bright = 77;
  const JournalEntry back = ParseJournal(FormatJournalLine(entry), "j").entries.at(0);
  EXPECT_TRUE(back.taken());
  EXPECT_EQ(back.attempts, 3);
  EXPECT_EQ(back.resent_packets, 12U);
  EXPECT_EQ(back.gain, 1.5);
  EXPECT_EQ(back.temperature_c, 40.25);
  EXPECT_EQ(back.largest, 4095);
  EXPECT_EQ(back.bright, 77);
  EXPECT_FALSE(ParseJournal(FormatJournalLine(EntryOf(0)), "j").entries.at(0).gain);
}

TEST(Journal, ASkippedPictureHasAReasonAndNoFile) {
  JournalEntry entry = EntryOf(0);
  entry.skipped = "nothing to see";
  const std::string line = FormatJournalLine(entry);
  EXPECT_EQ(line.find("\"file\""), std::string::npos);
  const JournalEntry back = ParseJournal(line, "j").entries.at(0);
  EXPECT_FALSE(back.taken());
  EXPECT_EQ(back.skipped, "nothing to see");
  EXPECT_EQ(back.spots, entry.spots);
}

// As version 0.1 wrote them, before `attempts`.
TEST(Journal, ReadsOlderLines) {
  const std::string text =
      R"({"number":0,"target":"flat","pose":0,"channel":-1,"group":-1,"repeat":1,)"
      R"("spots":[],"exposure_us":500.0,"applied_exposure_us":500.0,)"
      R"("file":"frames/000000.pgm","xxh3":"00","frame_id":1,"timestamp_ns":2})";
  const std::string line = text + '\t' + HashHex(text.data(), text.size()) + '\n';
  const Journal journal = ParseJournal(line, "j");
  ASSERT_EQ(journal.entries.size(), 1U);
  EXPECT_EQ(journal.entries[0].attempts, 1);
  EXPECT_EQ(journal.line_ends, (std::vector<std::uint64_t>{line.size()}));
}

TEST(Journal, EmptyIsFine) {
  EXPECT_TRUE(ParseJournal("", "journal").entries.empty());
}

TEST(Journal, TruncatedAtAnyByteKeepsTheWholeLines) {
  const std::string text = ThreeLines();
  std::vector<std::size_t> line_ends;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '\n') {
      line_ends.push_back(k + 1);
    }
  }
  for (std::size_t length = 0; length <= text.size(); ++length) {
    const Journal journal = ParseJournal(text.substr(0, length), "journal");
    const auto whole = static_cast<std::size_t>(std::count_if(
        line_ends.begin(), line_ends.end(), [&](auto end) { return end <= length; }));
    ASSERT_EQ(journal.entries.size(), whole) << "at byte " << length;
    EXPECT_EQ(journal.good_bytes, whole == 0 ? 0 : line_ends[whole - 1]);
    EXPECT_EQ(journal.good_bytes + journal.torn_bytes, length);
  }
}

TEST(Journal, AnyFlippedBitIsNoticed) {
  const std::string text = ThreeLines();
  const std::size_t line = FormatJournalLine(EntryOf(0)).size();
  for (std::size_t k = 0; k < text.size(); ++k) {
    std::string flipped = text;
    flipped[k] = static_cast<char>(flipped[k] ^ (1 << (k % 8)));
    if (k == 2 * line - 1) {  // the last two become one
      EXPECT_EQ(ParseJournal(flipped, "journal").entries.size(), 1U);
    } else if (k < 2 * line) {  // a good line follows: damage
      EXPECT_THROW(ParseJournal(flipped, "journal"), Error) << "at byte " << k;
    } else {  // the last line: it never was
      EXPECT_EQ(ParseJournal(flipped, "journal").entries.size(), 2U) << "at byte " << k;
    }
  }
}

TEST(Journal, DamageNamesTheLine) {
  std::string text = ThreeLines();
  text[FormatJournalLine(EntryOf(0)).size() + 5] = 'x';
  try {
    ParseJournal(text, "journal");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("journal:2: this line is damaged"));
  }
}

TEST(Journal, PicturesLieInTheSession) {
  for (const char* file :
       {"/etc/passwd", "../other/000001.pgm", "frames/../../x", ""}) {
    JournalEntry entry = EntryOf(0);
    entry.file = file;
    EXPECT_THAT(nacre::testing::ErrorMessage(
                    [&] { ParseJournal(FormatJournalLine(entry), "journal"); }),
                ::testing::HasSubstr("journal:1: field 'file': '"))
        << file;
  }
}

TEST(Journal, GarbageAtTheEndIsTornWhateverItsLines) {
  const std::string text = ThreeLines();
  const Journal journal =
      ParseJournal(text + std::string(100, '\0') + "\nx\n\n", "journal");
  EXPECT_EQ(journal.entries.size(), 3U);
  EXPECT_EQ(journal.good_bytes, text.size());
}

TEST(Journal, AMissingLineIsNoticed) {
  const std::string text =
      FormatJournalLine(EntryOf(0)) + FormatJournalLine(EntryOf(2));
  try {
    ParseJournal(text, "journal");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("journal:2: picture 2 where 1"));
  }
}

TEST(Journal, WriterCutsTheTornEndOff) {
  const testing::TempFolder folder;
  WriteFile(folder / "journal", ThreeLines() + "torn");
  {
    JournalWriter writer(folder / "journal", ThreeLines().size());
    writer.Append(EntryOf(3));
    writer.Flush();
  }
  EXPECT_EQ(ReadFile(folder / "journal"), ThreeLines() + FormatJournalLine(EntryOf(3)));
}

}  // namespace
}  // namespace nacre::acquire
