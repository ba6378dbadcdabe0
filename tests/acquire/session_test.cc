#include "acquire/session.h"

#include "acquire/frame_file.h"
#include "acquire/read_ahead.h"
#include "acquire/session_writer.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "tests/acquire/fake_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::acquire {
namespace {

using testing::FakeRig;
using ::testing::HasSubstr;
using testing::IdealScanMap;
using testing::TempFolder;
using testing::TestRig;

template <class Call>
std::string ErrorOf(Call call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

// A session of its calibration pictures in folder / "s".
void CaptureTargets(const TempFolder& folder) {
  FakeRig fake;
  auto session = SessionWriter::Create(folder / "s", fake.Manifest(TestRig()), false);
  CaptureCalibration(session, fake.devices());
}

void FlipByte(const std::filesystem::path& path, std::size_t at) {
  std::string bytes = ReadFile(path);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  WriteFile(path, bytes);
}

Frame SmallFrame() {
  Frame frame{.width = 3, .height = 2, .counts = {0, 1, 255, 256, 4095, 77}};
  return frame;
}

TEST(FrameFile, RoundTripAndKnownBytes) {
  const std::string bytes = EncodeFrame(SmallFrame(), 12);
  // The format of pgm(5), by hand.
  EXPECT_EQ(bytes,
            std::string("P5\n3 2\n4095\n"
                        "\0\0\0\1\0\xFF\1\0\x0F\xFF\0M",
                        24));
  const Frame frame = DecodeFrame(bytes, "f");
  EXPECT_EQ(frame.width, 3);
  EXPECT_EQ(frame.height, 2);
  EXPECT_EQ(frame.counts, SmallFrame().counts);
}

TEST(FrameFile, EightBitsAndColoursRoundTrip) {
  const Frame grey{.width = 3, .height = 1, .counts = {0, 128, 255}};
  EXPECT_EQ(EncodeFrame(grey, 8), std::string("P5\n3 1\n255\n\0\x80\xFF", 14));
  EXPECT_EQ(DecodeFrame(EncodeFrame(grey, 8), "f").counts, grey.counts);
  const Frame color{.width = 2, .height = 1, .counts = {1, 2, 3, 4, 5, 6}};
  EXPECT_EQ(EncodeFrame(color, 8), "P6\n2 1\n255\n\1\2\3\4\5\6");
  for (const int depth : {8, 12}) {
    const std::string bytes = EncodeFrame(color, depth);
    EXPECT_EQ(DecodeFrame(bytes, "f").counts, color.counts);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      EXPECT_THROW(DecodeFrame(bytes.substr(0, length), "f"), Error) << length;
    }
  }
}

TEST(FrameFile, AnyTruncationIsBadData) {
  const std::string bytes = EncodeFrame(SmallFrame(), 12);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW(DecodeFrame(bytes.substr(0, length), "f"), Error) << length;
  }
  EXPECT_THROW(DecodeFrame(bytes + "x", "f"), Error);
}

TEST(FrameFile, CountAboveTheMaximumIsBadData) {
  std::string bytes = EncodeFrame(SmallFrame(), 12);
  bytes[20] = '\x10';  // 4095 becomes 4351
  EXPECT_THAT(ErrorOf([&] { DecodeFrame(bytes, "f"); }),
              HasSubstr("f: a count of 4351 is above the sensor's maximum of 4095"));
}

TEST(Session, ReaderSeesWhatWasCaptured) {
  const TempFolder folder;
  CaptureTargets(folder);
  const SessionReader session(folder / "s");
  EXPECT_EQ(session.picture_count(), session.schedule().grid_begin());
  EXPECT_FALSE(session.IsComplete());
  EXPECT_FALSE(session.manifest().scan_map.has_value());
  EXPECT_EQ(session.manifest().camera.width, 6);
  EXPECT_EQ(session.manifest().illuminator.channels.size(), 2U);
  const Frame frame = session.ReadFrame(3);
  EXPECT_EQ(frame.counts.size(), 24U);
  EXPECT_EQ(frame.exposure_us, session.schedule()[3].exposure_us + 0.25);
  EXPECT_EQ(frame.frame_id, 3U);
}

TEST(Session, PictureNotTakenSaysSo) {
  const TempFolder folder;
  CaptureTargets(folder);
  const SessionReader session(folder / "s");
  EXPECT_THAT(ErrorOf([&] { session.ReadFrame(session.picture_count()); }),
              HasSubstr("hasn't been taken; finish with nacre capture --resume"));
}

TEST(Session, AFlippedBitInAFrameIsNoticed) {
  const TempFolder folder;
  CaptureTargets(folder);
  FlipByte(folder / "s" / "frames" / "000002.pgm", 30);
  const SessionReader session(folder / "s");
  EXPECT_NO_THROW(session.ReadFrame(1));
  EXPECT_THAT(ErrorOf([&] { session.ReadFrame(2); }),
              HasSubstr("000002.pgm: doesn't match its checksum"));
}

TEST(Session, AMissingPictureIsBadDataThatIsNamed) {
  const TempFolder folder;
  CaptureTargets(folder);
  std::filesystem::remove(folder / "s" / "frames" / "000002.pgm");
  const SessionReader session(folder / "s");
  try {
    session.ReadFrame(2);
    FAIL() << "a picture that isn't there was read";
  } catch (const nacre::Error& error) {
    EXPECT_EQ(error.code(), nacre::ExitCode::kBadData);
  }
  EXPECT_THAT(ErrorOf([&] { session.ReadFrame(2); }),
              HasSubstr("000002.pgm: picture 2 is in the journal"));
  // Read ahead, it is passed over.
  ReadAhead ahead(session, {0, 2, session.picture_count(), 1});
  ahead.Allow(100);
  EXPECT_NO_THROW(session.ReadFrame(1));
}

TEST(Session, AColourCamerasFramesAreKeptRawAndReadGreyIfOneLikes) {
  for (const std::string mosaic : {"RGGB", "RGB"}) {
    const TempFolder folder;
    FakeRig fake;
    SessionManifest manifest = fake.Manifest(TestRig());
    manifest.camera.mosaic = mosaic;
    auto session = SessionWriter::Create(folder / "s", manifest, false);
    Frame frame{.width = 6, .height = 4, .counts = {}};
    const std::size_t count = mosaic == "RGB" ? 72 : 24;
    for (std::size_t k = 0; k < count; ++k) {
      frame.counts.push_back(static_cast<std::uint16_t>(10 * k));
    }
    session.Append(frame);
    const SessionReader raw(folder / "s");
    EXPECT_EQ(raw.manifest().camera.mosaic, mosaic);
    EXPECT_EQ(raw.ReadFrame(0).counts, frame.counts);
    const Frame grey = SessionReader(folder / "s", FrameView::kGrey).ReadFrame(0);
    ASSERT_EQ(grey.counts.size(), 24U);
    // By hand: (0 + 10 + 60 + 70) / 4, and (0 + 10 + 20) / 3.
    EXPECT_EQ(grey.counts[0], mosaic == "RGB" ? 10 : 35);
    EXPECT_EQ(grey.counts[23], mosaic == "RGB" ? 700 : grey.counts[16]);
    manifest.camera.mosaic = "";
    EXPECT_THAT(ErrorOf([&] { SessionWriter::Resume(folder / "s", manifest, false); }),
                ::testing::AnyOf(HasSubstr("begun with the camera"),
                                 HasSubstr("is capturing into this session")));
  }
}

TEST(Session, FoldersThatAreNone) {
  const TempFolder folder;
  EXPECT_THAT(ErrorOf([&] { SessionReader{folder.path()}; }),
              HasSubstr("not a session folder"));
  WriteFile(folder / "session.json", "{\"format\": \"other\"}\n");
  EXPECT_THAT(ErrorOf([&] { SessionReader{folder.path()}; }),
              HasSubstr("not the manifest of a session"));
}

TEST(Session, AManifestTruncatedAnywhereIsBadData) {
  const TempFolder folder;
  CaptureTargets(folder);
  const std::filesystem::path path = folder / "s" / "session.json";
  const std::string text = ReadFile(path);
  for (std::size_t length = 0; length + 2 < text.size(); length += 7) {
    WriteFile(path, text.substr(0, length));
    EXPECT_THROW(SessionReader{folder / "s"}, Error) << length;
  }
}

TEST(Session, AnEditedRigInTheManifestIsNoticed) {
  const TempFolder folder;
  CaptureTargets(folder);
  const std::filesystem::path path = folder / "s" / "session.json";
  std::string text = ReadFile(path);
  text.replace(text.find("pitch_mm = 0.5"), 14, "pitch_mm = 0.6");
  WriteFile(path, text);
  EXPECT_THAT(ErrorOf([&] { SessionReader{folder / "s"}; }),
              HasSubstr("doesn't match its checksum 'rig_xxh3'"));
}

TEST(Session, CreateRefusesAnExistingOne) {
  const TempFolder folder;
  CaptureTargets(folder);
  const FakeRig fake;
  try {
    SessionWriter::Create(folder / "s", fake.Manifest(TestRig()), false);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(), HasSubstr("there is a session already"));
  }
}

TEST(Session, ResumeRefusesAnotherRigAndSaysWhatDiffers) {
  const TempFolder folder;
  CaptureTargets(folder);
  const FakeRig fake;
  const auto resume = [&](const SessionManifest& manifest) {
    return ErrorOf([&] { SessionWriter::Resume(folder / "s", manifest, false); });
  };
  EXPECT_EQ(resume(fake.Manifest(TestRig())), "no error");
  EXPECT_THAT(resume(fake.Manifest(TestRig({{"pitch_mm = 0.5", "pitch_mm = 0.6"}}))),
              HasSubstr("line 9 was 'pitch_mm = 0.5' and is 'pitch_mm = 0.6'"));
  SessionManifest other = fake.Manifest(TestRig());
  other.camera.serial = "99";
  EXPECT_THAT(resume(other), HasSubstr("begun with the camera fake camera 1 and this"));
  other = fake.Manifest(TestRig());
  other.illuminator.serial = "98";
  EXPECT_THAT(resume(other), HasSubstr("begun with the laser fake laser 2 and this"));
  other = fake.Manifest(TestRig());
  other.seed = 7;
  EXPECT_THAT(resume(other), HasSubstr("the seed was 1 and is 7"));
}

TEST(Session, OnlyOneProcessWrites) {
  const TempFolder folder;
  const FakeRig fake;
  const auto session =
      SessionWriter::Create(folder / "s", fake.Manifest(TestRig()), false);
  // flock is held by the open file, so that a second opening conflicts even here.
  EXPECT_THAT(ErrorOf([&] {
                SessionWriter::Resume(folder / "s", fake.Manifest(TestRig()), false);
              }),
              HasSubstr("is capturing into this session"));
}

TEST(Session, LaserChannelsMustBeTheRigs) {
  const FakeRig fake;
  EXPECT_THAT(
      ErrorOf([&] {
        fake.Manifest(TestRig({{"[\"R\", \"G\"]", "[\"R\", \"B\"]"}}));
      }),
      HasSubstr("scanner.channels is [R, B], but the laser fake laser has [R, G]"));
}

TEST(Session, TheScanMapIsKept) {
  const TempFolder folder;
  CaptureTargets(folder);
  const FakeRig fake;
  ScanMap map = IdealScanMap(300);
  map.y_rad[9] = 1.0 / 3;  // every bit of it
  SessionWriter::Resume(folder / "s", fake.Manifest(TestRig()), true).SetScanMap(map);
  EXPECT_EQ(SessionReader(folder / "s").manifest().scan_map, map);
}

TEST(ScanMap, IsEvaluatedBothWays) {
  ScanMap map = IdealScanMap(200);
  EXPECT_DOUBLE_EQ(map.AngleFromSample({4, -2}).x_rad, 0.02);
  EXPECT_DOUBLE_EQ(map.AngleFromSample({4, -2}).y_rad, -0.01);
  EXPECT_DOUBLE_EQ(map.SampleFromAngle({0.02, -0.01}).x, 4);
  map.half_width_mm = 2;
  map.x_rad = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  // u = 1.5, v = -0.5, by hand.
  const double expected = 1 + 3 - 1.5 + 4 * 2.25 - 5 * 0.75 + 6 * 0.25 + 7 * 3.375 -
                          8 * 1.125 + 9 * 0.375 - 10 * 0.125;
  EXPECT_DOUBLE_EQ(map.AngleFromSample({3, -1}).x_rad, expected);
}

TEST(ScanMap, BadFieldsAreNamed) {
  Json json = ToJson(IdealScanMap(1));
  json["x_mm"].erase(9);
  EXPECT_THAT(ErrorOf([&] { ScanMapFromJson(json, "m"); }),
              HasSubstr("m: field 'x_mm' must hold ten numbers"));
  json = ToJson(IdealScanMap(1));
  json["half_width_mm"] = 0;
  EXPECT_THAT(ErrorOf([&] { ScanMapFromJson(json, "m"); }),
              HasSubstr("m: field 'half_width_mm' must be positive"));
}

}  // namespace
}  // namespace nacre::acquire
