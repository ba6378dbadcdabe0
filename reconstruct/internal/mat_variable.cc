#include "reconstruct/internal/mat_variable.h"

#include "core/error.h"
#include "core/write_all.h"
#include "reconstruct/internal/child_process.h"
#include "reconstruct/internal/mat_elements.h"

#include <array>
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>
#include <hdf5.h>
#include <matio.h>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace nacre::reconstruct::internal {
namespace {

using File = std::unique_ptr<mat_t, int (*)(mat_t*)>;
using Variable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;

// deflate can't pack better than this.
constexpr double kMaxPacking = 1032;

std::optional<NumberType> TypeOf(const matvar_t& variable) {
  if (variable.isComplex != 0) {
    return std::nullopt;
  }
  switch (variable.class_type) {
    case MAT_C_UINT8:
      return NumberType::kUint8;
    case MAT_C_UINT16:
      return NumberType::kUint16;
    case MAT_C_SINGLE:
      return NumberType::kFloat32;
    case MAT_C_DOUBLE:
      return NumberType::kFloat64;
    default:
      return std::nullopt;
  }
}

std::vector<std::int64_t> ExtentOf(const matvar_t& variable) {
  std::vector<std::int64_t> extent;
  for (int n = 0; n < variable.rank && variable.dims != nullptr; ++n) {
    extent.push_back(static_cast<std::int64_t>(variable.dims[n]));
  }
  return extent;
}

enum class Version { k5, kHdf5 };

// libmatio guesses at the kind of anything; only what begins like one of the versions
// and is as long as it says is given to it.
Version CheckWhole(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || !std::filesystem::is_regular_file(path)) {
    throw Error("cannot read " + path.string() + ": there is no such file");
  }
  std::array<char, 128> head{};
  file.read(head.data(), head.size());
  const std::string_view text(head.data(), static_cast<std::size_t>(file.gcount()));
  file.clear();
  constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";
  if (!text.starts_with("MATLAB") || text.size() < head.size()) {
    throw BadData(
        path.string() +
        ": isn't a MATLAB file of version 5 or 7.3; save it with -v7 or -v7.3");
  }
  const bool big_endian = text.ends_with("MI");
  const int major = static_cast<unsigned char>(
      text[big_endian ? 124 : 125]);  // 1: version 5, 2: HDF5
  std::array<char, 8> beyond{};
  file.seekg(512);
  file.read(beyond.data(), beyond.size());
  if (major != 2 || std::string_view(beyond.data(), beyond.size()) != kHdf5) {
    file.clear();
    CheckMatElements(file, big_endian, path.string());
  }
  return major == 2 ? Version::kHdf5 : Version::k5;
}

// HDF5 prints its stack of calls for every damaged file. The errors are ours to tell.
void SilenceHdf5() {
  constexpr hid_t kDefaultStack = 0;
  Expect(H5Eset_auto2(kDefaultStack, nullptr, nullptr) >= 0,
         "an HDF5 library that can be silenced");
}

File Open(const std::filesystem::path& path) {
  File file(Mat_Open(path.c_str(), MAT_ACC_RDONLY), Mat_Close);
  if (file == nullptr) {
    throw BadData(path.string() + ": isn't a readable MATLAB file (.mat)");
  }
  return file;
}

// The name of the variable to read: that asked for, or the only one that can be meant.
std::string FindVariable(const std::filesystem::path& path, const std::string& wanted) {
  const File file = Open(path);
  std::vector<std::string> fitting;
  std::vector<std::string> all;
  constexpr int kMostVariables = 10000;
  for (int n = 0; n < kMostVariables; ++n) {
    const Variable variable(Mat_VarReadNextInfo(file.get()), Mat_VarFree);
    if (variable == nullptr) {
      break;
    }
    const std::string name = variable->name != nullptr ? variable->name : "";
    all.push_back(name);
    const bool fits = TypeOf(*variable) && (variable->rank == 4 || variable->rank == 5);
    if (wanted.empty() ? fits : name == wanted) {
      fitting.push_back(name);
    }
  }
  if (fitting.size() != 1) {
    const std::string what =
        !wanted.empty() ? fmt::format("no variable '{}'", wanted)
        : fitting.empty()
            ? std::string("no array of real numbers with four or five axes")
            : fmt::format("{} arrays that may be meant: say --variable",
                          fitting.size());
    throw BadData(fmt::format("{}: {} (it holds: {})",
                              path.string(),
                              what,
                              fmt::join(fitting.empty() ? all : fitting, ", ")));
  }
  return fitting[0];
}

// HDF5 takes memory for what an element is said to be: 4 GB in a damaged file.
void CheckElementBytes(const std::filesystem::path& path, const std::string& name) {
  if (H5Fis_hdf5(path.c_str()) <= 0) {
    return;  // version 5
  }
  using Id = std::unique_ptr<hid_t, void (*)(hid_t*)>;
  const auto keep = [](hid_t& id) {
    return Id(id >= 0 ? &id : nullptr, [](hid_t* of) { H5Idec_ref(*of); });
  };
  hid_t file_id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const Id file = keep(file_id);
  hid_t set_id = file ? H5Dopen2(file_id, ("/" + name).c_str(), H5P_DEFAULT) : -1;
  const Id set = keep(set_id);
  hid_t type_id = set ? H5Dget_type(set_id) : -1;
  const Id type = keep(type_id);
  const std::size_t bytes = type ? H5Tget_size(type_id) : 0;
  if (bytes == 0 || bytes > sizeof(double)) {
    throw BadData(fmt::format(
        "{}: variable '{}' has elements of {} bytes", path.string(), name, bytes));
  }
}

// The variable as libmatio has read it.
Variable ReadHere(const std::filesystem::path& path,
                  const std::string& wanted,
                  std::size_t max_bytes) {
  const std::string name = FindVariable(path, wanted);
  const File file = Open(path);
  Variable variable(Mat_VarReadInfo(file.get(), name.c_str()), Mat_VarFree);
  const std::optional<NumberType> type =
      variable != nullptr ? TypeOf(*variable) : std::nullopt;
  if (!type) {
    throw BadData(fmt::format(
        "{}: variable '{}' isn't an array of real double, single, uint8 or uint16",
        path.string(),
        name));
  }
  const std::vector<std::int64_t> extent = ExtentOf(*variable);
  auto bytes = static_cast<double>(ByteSize(*type));
  for (const std::int64_t of_axis : extent) {
    bytes *= static_cast<double>(of_axis);
  }
  const auto file_bytes = static_cast<double>(std::filesystem::file_size(path));
  if (!(bytes > 0) || bytes > kMaxPacking * file_bytes ||
      bytes > static_cast<double>(max_bytes)) {
    throw BadData(
        fmt::format("{}: variable '{}' of {} declares {:.0f} bytes; a file of {:.0f} "
                    "bytes holds at "
                    "most {:.0f}, and {} are read at most",
                    path.string(),
                    name,
                    extent,
                    bytes,
                    file_bytes,
                    kMaxPacking * file_bytes,
                    max_bytes));
  }
  CheckElementBytes(path, name);
  if (Mat_VarReadDataAll(file.get(), variable.get()) != 0 ||
      variable->data == nullptr || static_cast<double>(variable->nbytes) != bytes) {
    throw BadData(
        fmt::format("{}: variable '{}' is truncated or damaged: get the file again",
                    path.string(),
                    name));
  }
  return variable;
}

MatVariable Described(Variable variable) {
  MatVariable result;
  result.type = TypeOf(*variable).value();
  result.extent = ExtentOf(*variable);
  const auto* data = static_cast<const unsigned char*>(variable->data);
  result.data = {std::shared_ptr<matvar_t>(std::move(variable)), data};
  return result;
}

// From the child process to here: the numbers' type, how many axes, their extents,
// data.
void Send(int fd, const MatVariable& variable) {
  std::vector<std::int64_t> head = {static_cast<std::int64_t>(variable.type),
                                    static_cast<std::int64_t>(variable.extent.size())};
  head.insert(head.end(), variable.extent.begin(), variable.extent.end());
  const auto as_text = [](const auto* data, std::size_t bytes) {
    return std::string_view(reinterpret_cast<const char*>(data), bytes);
  };
  if (!WriteAll(fd, as_text(head.data(), head.size() * sizeof(head[0]))) ||
      !WriteAll(fd, as_text(variable.data.get(), ByteSize(variable)))) {
    throw SystemError("cannot keep an array in memory");
  }
}

MatVariable Received(std::unique_ptr<MappedFile> file) {
  const std::span<const unsigned char> bytes = file->bytes();
  const auto number = [&](std::size_t n) {
    std::int64_t value = 0;
    Expect(bytes.size() >= (n + 1) * sizeof(value), "the whole head of an array");
    std::memcpy(&value, bytes.data() + n * sizeof(value), sizeof(value));
    return value;
  };
  MatVariable result;
  result.type = static_cast<NumberType>(number(0));
  const auto axes = static_cast<std::size_t>(number(1));
  for (std::size_t axis = 0; axis < axes; ++axis) {
    result.extent.push_back(number(2 + axis));
  }
  const std::size_t head_bytes = (2 + axes) * sizeof(std::int64_t);
  Expect(bytes.size() == head_bytes + ByteSize(result), "the whole array");
  result.data = {std::shared_ptr<MappedFile>(std::move(file)),
                 bytes.data() + head_bytes};
  return result;
}

// No disk or processor is slower than this by itself.
int MostSeconds(const std::filesystem::path& path) {
  constexpr double kBytesPerSecond = 1e6;
  return 60 + static_cast<int>(static_cast<double>(std::filesystem::file_size(path)) /
                               kBytesPerSecond);
}

}  // namespace

MatVariable ReadMatVariable(const std::filesystem::path& path,
                            const std::string& name,
                            std::size_t max_bytes) {
  if (CheckWhole(path) == Version::k5) {
    return Described(ReadHere(path, name, max_bytes));
  }
  return Received(RunInChild(path.string(), MostSeconds(path), [&](int fd) {
    SilenceHdf5();
    Send(fd, Described(ReadHere(path, name, max_bytes)));
  }));
}

std::size_t ByteSize(NumberType type) {
  constexpr std::array<std::size_t, 4> kSizes = {1, 2, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::size_t ByteSize(const MatVariable& variable) {
  std::size_t bytes = ByteSize(variable.type);
  for (const std::int64_t extent : variable.extent) {
    bytes *= static_cast<std::size_t>(extent);
  }
  return bytes;
}

}  // namespace nacre::reconstruct::internal
