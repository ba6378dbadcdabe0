#include "acquire/internal/aravis_connection.h"

#include "acquire/internal/aravis_settings.h"

#include <algorithm>
#include <thread>

namespace nacre::acquire::internal {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// A camera frees itself of a program that died when it misses its heartbeat for 3 s.
constexpr milliseconds kHeartbeatPassed{4000};
constexpr milliseconds kReconnectPause{250};
constexpr milliseconds kSlice{100};
constexpr int kBuffers = 4;
constexpr guint64 kControlChannelPrivilege = 0x0A00;  // a register of GigE Vision

void NoteLoss(ArvDevice*, gpointer lost) {
  *static_cast<std::atomic<bool>*>(lost) = true;
}

// Cameras put it into chunks and files; the camera twin takes its noise from it.
constexpr const char* kNumberFeature = "UserDefinedValue";
constexpr const char* kTemperatureFeature = "DeviceTemperature";
constexpr std::chrono::seconds kTemperaturePeriod{1};

}  // namespace

AravisConnection::AravisConnection(const AravisOptions& options,
                                   CameraStatistics& statistics)
    : options_(options), format_(WantedFormat(options_)), statistics_(statistics) {
  GErrorSlot error;
  camera_.reset(arv_camera_new(options_.id.c_str(), error.out()));
  if (!camera_) {
    throw DeviceError(
        fmt::format("camera {}: {}; `nacre doctor` lists the cameras "
                    "that answer",
                    options_.id,
                    error.message()));
  }
  g_signal_connect(arv_camera_get_device(camera_.get()),
                   "control-lost",
                   G_CALLBACK(NoteLoss),
                   &control_lost_);
  TakeControl();
  ApplySettings(camera_.get(), options_);
  info_ = ReadInfo(camera_.get(), options_);
  GErrorSlot error_of_extras;  // what a camera lacks is no error
  takes_number_ = arv_camera_is_feature_available(
      camera_.get(), kNumberFeature, error_of_extras.out());
  has_temperature_ = arv_camera_is_feature_available(
      camera_.get(), kTemperatureFeature, error_of_extras.out());
  if (arv_camera_is_gain_available(camera_.get(), error_of_extras.out())) {
    const double gain = arv_camera_get_gain(camera_.get(), error_of_extras.out());
    gain_ = error_of_extras.failed() ? std::nullopt : std::optional(gain);
  }
  OpenStream();
}

AravisConnection::~AravisConnection() {
  if (stream_ && !control_lost_) {
    // The camera goes idle by itself if this doesn't reach it.
    GErrorSlot ignored;
    arv_camera_stop_acquisition(camera_.get(), ignored.out());
  }
  if (lender_) {
    lender_->Close();
  }
  stream_.reset();
  if (camera_) {
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()),
                                         &control_lost_);
  }
}

void AravisConnection::TakeControl() {
  if (!arv_camera_is_gv_device(camera_.get())) {
    return;  // USB lends a device to one program only
  }
  ArvGvDevice* device = ARV_GV_DEVICE(arv_camera_get_device(camera_.get()));
  const auto deadline =
      Clock::now() +
      std::min(kHeartbeatPassed,
               milliseconds(static_cast<std::int64_t>(1000 * options_.reconnect_s)));
  GErrorSlot error;
  while (!arv_gv_device_is_controller(device)) {
    if (arv_gv_device_take_control(device, error.out())) {
      return;
    }
    if (Clock::now() >= deadline) {
      throw DeviceError(
          fmt::format("camera {}: another program controls it; end that "
                      "one first",
                      options_.id));
    }
    std::this_thread::sleep_for(kReconnectPause);
  }
}

void AravisConnection::OpenStream() {
  GErrorSlot error;
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, error.out()));
  error.Check(options_.id, "open its stream");
  if (arv_camera_is_gv_device(camera_.get())) {
    g_object_set(stream_.get(),
                 "socket-buffer",
                 ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                 "socket-buffer-size",
                 options_.socket_buffer_bytes,
                 nullptr);
  }
  payload_bytes_ = arv_camera_get_payload(camera_.get(), error.out());
  error.Check(options_.id, "read the size of its frames");
  lender_ = std::make_shared<BufferReturn>(stream_.get());
  for (int k = 0; k < kBuffers; ++k) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new(payload_bytes_, nullptr));
  }
  arv_camera_start_acquisition(camera_.get(), error.out());
  error.Check(options_.id, "start acquisition");
}

bool AravisConnection::IsConnected() {
  if (control_lost_) {
    return false;
  }
  if (arv_camera_is_gv_device(camera_.get())) {
    // Zero: nobody controls it, since it was switched off or missed our heartbeat. Else
    // somebody does, and who it is shows in whether we may write.
    ArvDevice* device = arv_camera_get_device(camera_.get());
    GErrorSlot error;
    guint32 privilege = 0;
    arv_device_read_register(device, kControlChannelPrivilege, &privilege, error.out());
    control_lost_ = error.failed() || privilege == 0 ||
                    !arv_gv_device_take_control(ARV_GV_DEVICE(device), error.out());
  }
  return !control_lost_;
}

double AravisConnection::SetExposureUs(double exposure_us) {
  return ApplyExposureUs(camera_.get(), options_.id, exposure_us);
}

void AravisConnection::DropLateFrames() {
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_.get())) {
    ++statistics_.late;
    last_frame_id_ = arv_buffer_get_frame_id(buffer);
    arv_stream_push_buffer(stream_.get(), buffer);
  }
}

// The frame's memory, given back to the stream once nobody needs it. The stream never
// runs out of memory for the next ones.
std::shared_ptr<ArvBuffer> AravisConnection::Lend(ArvBuffer* buffer) {
  gint waiting = 0;
  arv_stream_get_n_buffers(stream_.get(), &waiting, nullptr);
  if (waiting < kBuffers - 1) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new(payload_bytes_, nullptr));
  }
  return {buffer, [lender = lender_](ArvBuffer* lent) { lender->Take(lent); }};
}

void AravisConnection::TellNumber(std::uint64_t picture_number) {
  if (!takes_number_ || told_number_ == picture_number) {
    return;
  }
  GErrorSlot error;
  arv_camera_set_integer(
      camera_.get(), kNumberFeature, static_cast<gint64>(picture_number), error.out());
  error.Check(options_.id, "tell it the picture's number");
  told_number_ = picture_number;
}

void AravisConnection::ReadTemperature() {
  if (!has_temperature_ || Clock::now() - temperature_at_ < kTemperaturePeriod) {
    return;
  }
  GErrorSlot error;
  const double temperature_c =
      arv_camera_get_float(camera_.get(), kTemperatureFeature, error.out());
  temperature_c_ = error.failed() ? std::nullopt : std::optional(temperature_c);
  temperature_at_ = Clock::now();
}

// Makes the camera forget triggers that are still under way.
void AravisConnection::Restart() {
  GErrorSlot error;
  arv_camera_stop_acquisition(camera_.get(), error.out());
  error.Check(options_.id, "stop acquisition");
  DropLateFrames();
  last_frame_id_.reset();  // cameras may or may not count from one again
  arv_camera_start_acquisition(camera_.get(), error.out());
  error.Check(options_.id, "start acquisition");
}

ArvBuffer* AravisConnection::WaitForBuffer(milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const auto left =
        std::clamp(std::chrono::duration_cast<milliseconds>(deadline - Clock::now()),
                   milliseconds(1),
                   kSlice);
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
        stream_.get(), static_cast<guint64>(left.count()) * 1000);
    if (buffer != nullptr || control_lost_ || Clock::now() >= deadline) {
      return buffer;
    }
  }
}

std::optional<PackedFrame> AravisConnection::Capture(std::uint64_t picture_number,
                                                     milliseconds timeout) {
  DropLateFrames();
  TellNumber(picture_number);
  if (options_.trigger == "Software") {
    GErrorSlot error;
    arv_camera_software_trigger(camera_.get(), error.out());
    error.Check(options_.id, "trigger it");
  }
  ArvBuffer* buffer = WaitForBuffer(timeout);
  if (buffer == nullptr) {
    if (!IsConnected()) {
      throw DeviceError(fmt::format("camera {}: it is gone", options_.id));
    }
    ++statistics_.timed_out;
    Restart();
    return std::nullopt;
  }
  return Read(Lend(buffer));
}

// GigE Vision counts in 16 bits and leaves zero out, or in 64 bits; USB3 in 64.
bool AravisConnection::IsDue(std::uint64_t frame_id) const {
  return !last_frame_id_ || frame_id == *last_frame_id_ + 1 ||
         (*last_frame_id_ == 0xFFFF && frame_id == 1);
}

std::optional<PackedFrame> AravisConnection::Read(
    const std::shared_ptr<ArvBuffer>& buffer) {
  const std::uint64_t frame_id = arv_buffer_get_frame_id(buffer.get());
  const bool due = IsDue(frame_id);
  last_frame_id_ = frame_id;
  if (arv_buffer_get_status(buffer.get()) != ARV_BUFFER_STATUS_SUCCESS ||
      arv_buffer_get_payload_type(buffer.get()) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE) {
    ++statistics_.incomplete;
    return std::nullopt;
  }
  if (!due) {
    ++statistics_.skipped_ids;
    Restart();
    return std::nullopt;
  }
  std::size_t size = 0;
  const auto* bytes =
      static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer.get(), &size));
  PackedFrame packed;
  Frame& frame = packed.frame;
  frame.width = arv_buffer_get_image_width(buffer.get());
  frame.height = arv_buffer_get_image_height(buffer.get());
  const std::size_t count = static_cast<std::size_t>(info_.width) *
                            static_cast<std::size_t>(info_.height) *
                            static_cast<std::size_t>(format_.SamplesPerPixel());
  const ArvPixelFormat code = arv_buffer_get_image_pixel_format(buffer.get());
  if (frame.width != info_.width || frame.height != info_.height ||
      code != format_.code || size < format_.ByteCount(count)) {
    throw DeviceError(
        fmt::format("camera {}: its frame is {} x {} pixels of format {:#x} in {} "
                    "bytes, not {} x {} "
                    "of {}; switch chunk data and other additions off in the camera",
                    options_.id,
                    frame.width,
                    frame.height,
                    code,
                    size,
                    info_.width,
                    info_.height,
                    format_.name));
  }
  frame.frame_id = frame_id;
  frame.timestamp_ns =
      static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer.get()));
  frame.gain = gain_;
  ReadTemperature();
  frame.temperature_c = temperature_c_;
  const std::uint64_t resent = StreamCount("n_resent_packets");
  frame.resent_packets = resent - resent_packets_;
  resent_packets_ = resent;
  packed.unpack = [buffer, bytes, size, count, &format = format_](Frame& unpacked) {
    unpacked.counts.resize(count);
    Unpack(format, {bytes, size}, unpacked.counts);
  };
  ++statistics_.frames;
  return packed;
}

std::uint64_t AravisConnection::StreamCount(const char* name) const {
  return arv_camera_is_gv_device(camera_.get())
             ? arv_stream_get_info_uint64_by_name(stream_.get(), name)
             : 0;
}

}  // namespace nacre::acquire::internal
