// How a reconstruction runs: threads, memory, what is missing, what it goes on from.

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/sanitizers.h"
#include "reconstruct/reconstruct.h"
#include "tests/reconstruct/striped_session.h"
#include "tests/support/error_message.h"
#include "tests/support/thread_ranks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <malloc.h>

namespace nacre::reconstruct {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;
using ReconstructTest = StripedSession;

TEST_F(ReconstructTest, BytesDependOnNeitherThreadsNorMemory) {
  ReconstructOptions options;
  options.thread_count = 1;
  options.memory_bytes = 1;
  Reconstruct(Session(), shared->calibration, Path("one.rd.exr"), options);
  for (const int threads : {2, 3}) {
    options.thread_count = threads;
    options.memory_bytes = 1e9;
    Reconstruct(Session(), shared->calibration, Path("many.rd.exr"), options);
    EXPECT_TRUE(ReadFile(Path("many.rd.exr")) == ReadFile(Path("one.rd.exr")));
  }
}

TEST_F(ReconstructTest, BytesDontDependOnTheNumberOfRanks) {
  Reconstruct(Session(), shared->calibration, Path("one.rd.exr"), {});
  for (const int size : {2, 3}) {
    std::filesystem::remove(Path("many.rd.exr"));
    nacre::testing::OnThreadRanks(size, [&](const Ranks& ranks) {
      ReconstructOptions options;
      options.thread_count = 1;
      options.ranks = &ranks;
      const ReconstructSummary summary =
          Reconstruct(Session(), shared->calibration, Path("many.rd.exr"), options);
      EXPECT_GT(summary.frame_count, 0);
    });
    EXPECT_TRUE(ReadFile(Path("many.rd.exr")) == ReadFile(Path("one.rd.exr")));
  }
}

// A number of kB from /proc/self/status.
std::size_t StatusKb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(key + ":", 0) == 0) {
      return std::stoul(line.substr(key.size() + 1));
    }
  }
  return 0;
}

TEST_F(ReconstructTest, MemoryStaysUnderTheBoundOnASessionEightTimesLarger) {
#if NACRE_UNDER_ASAN || NACRE_UNDER_TSAN
  GTEST_SKIP() << "sanitizers have memory of their own";
#endif
  double session_bytes = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(Path("session") / "frames")) {
    session_bytes += static_cast<double>(file.file_size());
  }
  ReconstructOptions options;
  options.memory_bytes = session_bytes / 8;
  options.thread_count = 2;
  const acquire::SessionReader session = Session();
  // Once before, for libraries' code and threads, which are not the session's.
  Reconstruct(session, shared->calibration, Path("m.rd.exr"), options);
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak begins anew
  const std::size_t before_kb = StatusKb("VmRSS");
  Reconstruct(session, shared->calibration, Path("m.rd.exr"), options);
  const std::size_t peak_kb = StatusKb("VmHWM");
  ASSERT_GT(before_kb, 0U);
  EXPECT_LT(1024.0 * static_cast<double>(peak_kb - before_kb), options.memory_bytes);
}

TEST_F(ReconstructTest, TheCalibrationMustBeOfTheSameRig) {
  calibrate::Calibration other = shared->calibration;
  other.session_rig_hash = "another";
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(Session(), other, Path("y.rd.exr"), {}); }),
      HasSubstr("calibration is of rig another"));
  other = shared->calibration;
  other.camera.width_px = 7;
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(Session(), other, Path("y.rd.exr"), {}); }),
      HasSubstr("200 x 200 pixels, the calibrated camera 7 x 200"));
  other = shared->calibration;
  other.channels.pop_back();
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(Session(), other, Path("y.rd.exr"), {}); }),
      HasSubstr("2 laser channels, the calibration has 1"));
  EXPECT_FALSE(std::filesystem::exists(Path("y.rd.exr")));
}

TEST_F(ReconstructTest, MissingPicturesAreNamed) {
  const std::filesystem::path cut = Path("cut");
  std::filesystem::copy(Path("session"), cut, std::filesystem::copy_options::recursive);
  const std::string journal = ReadFile(cut / "journal");
  WriteFile(
      cut / "journal",
      std::string_view(journal).substr(0, journal.rfind('\n', journal.size() - 2) + 1));
  EXPECT_THAT(
      ErrorMessage([&] {
        Reconstruct(
            acquire::SessionReader(cut), shared->calibration, Path("y.rd.exr"), {});
      }),
      HasSubstr("--resume"));
}

// As long as nothing is lost and nothing read twice: first the pictures of some groups,
// then all, then the same again, against one run over all.
TEST_F(ReconstructTest, LaterRunsReadOnlyWhatIsNew) {
  const std::filesystem::path part = Path("part");
  std::filesystem::copy(
      Path("session"), part, std::filesystem::copy_options::recursive);
  const std::string journal = ReadFile(part / "journal");
  const acquire::SessionReader whole = Session();
  // 3 groups and a picture.
  const std::int64_t lines = whole.schedule().grid_begin() + 3 * 6 + 1;
  std::size_t end = 0;
  for (std::int64_t line = 0; line < lines; ++line) {
    end = journal.find('\n', end) + 1;
  }
  WriteFile(part / "journal", std::string_view(journal).substr(0, end));
  ReconstructOptions options;
  options.incremental = true;
  const std::filesystem::path out = Path("inc.rd.exr");
  ReconstructSummary summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.frame_count, 18);
  EXPECT_EQ(summary.groups_missing, summary.group_count - 3);
  EXPECT_GT(summary.invalid_count, 0);

  WriteFile(part / "journal", journal);
  summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.groups_reused, 3);
  EXPECT_EQ(summary.groups_missing, 0);
  EXPECT_EQ(summary.frame_count, 6 * (summary.group_count - 3));
  Reconstruct(
      acquire::SessionReader(part), shared->calibration, Path("one.rd.exr"), {});
  EXPECT_TRUE(ReadFile(out) == ReadFile(Path("one.rd.exr")));

  summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.frame_count, 0);
  EXPECT_TRUE(ReadFile(out) == ReadFile(Path("one.rd.exr")));

  // A work file that was damaged, or of another calibration, costs time and no more.
  std::string work = ReadFile(Path("inc.rd.exr.work"));
  work[work.size() / 2] = static_cast<char>(work[work.size() / 2] ^ 1);
  WriteFile(Path("inc.rd.exr.work"), work);
  summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.frame_count, 6);
  EXPECT_TRUE(ReadFile(out) == ReadFile(Path("one.rd.exr")));
  calibrate::Calibration other = shared->calibration;
  other.read_noise_electrons *= 1.01;
  summary = Reconstruct(acquire::SessionReader(part), other, out, options);
  EXPECT_EQ(summary.groups_reused, 0);
}

TEST_F(ReconstructTest, StoppingLeavesNothing) {
  EXPECT_THROW(Reconstruct(Session(),
                           shared->calibration,
                           Path("y.rd.exr"),
                           {},
                           [](const Progress& state) { return state.done < 2; }),
               Error);
  EXPECT_FALSE(std::filesystem::exists(Path("y.rd.exr")));
}

}  // namespace
}  // namespace nacre::reconstruct
