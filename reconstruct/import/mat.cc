#include "reconstruct/import/mat.h"

#include "core/error.h"
#include "reconstruct/internal/mat_elements.h"

#include <bit>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>
#include <hdf5.h>
#include <matio.h>
#include <memory>
#include <optional>

namespace nacre::reconstruct {
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

std::int64_t SizeOf(NumberType type) {
  constexpr std::array<std::int64_t, 4> kSizes = {1, 2, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

// libmatio guesses at the kind of anything; only what begins like one of the versions
// and is as long as it says is given to it.
void CheckWhole(const std::filesystem::path& path) {
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
  const int major = text[big_endian ? 124 : 125];  // 1: version 5, 2: HDF5
  std::array<char, 8> beyond{};
  file.seekg(512);
  file.read(beyond.data(), beyond.size());
  if (major != 2 || std::string_view(beyond.data(), beyond.size()) != kHdf5) {
    file.clear();
    CheckMatElements(file, big_endian, path.string());
  }
}

// HDF5, which matio reads version 7.3 by, prints its stack of calls for every damaged
// file, and at the end of the program what such a file left behind. The errors are ours
// to tell.
void SilenceHdf5() {
  static const bool is_silent = [] {
    constexpr hid_t kDefaultStack = 0;
    H5dont_atexit();  // refused where the program has used HDF5 already, which may be
    return H5Eset_auto2(kDefaultStack, nullptr, nullptr) >= 0;
  }();
  Expect(is_silent, "an HDF5 library that can be silenced");
}

File Open(const std::filesystem::path& path) {
  CheckWhole(path);
  SilenceHdf5();
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

}  // namespace

ImportSummary ImportMat(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ArrayImportOptions& array_options,
                        const ProgressFunction& progress,
                        std::size_t max_bytes) {
  const std::string origin = from.string();
  const std::string name = FindVariable(from, array_options.variable);
  const File file = Open(from);
  Variable variable(Mat_VarReadInfo(file.get(), name.c_str()), Mat_VarFree);
  const std::optional<NumberType> type =
      variable != nullptr ? TypeOf(*variable) : std::nullopt;
  if (!type) {
    throw BadData(fmt::format(
        "{}: variable '{}' isn't an array of real double, single, uint8 or uint16",
        origin,
        name));
  }
  ArrayView array;
  array.type = *type;
  array.extent = ExtentOf(*variable);
  double bytes = static_cast<double>(SizeOf(*type));
  for (const std::int64_t extent : array.extent) {
    bytes *= static_cast<double>(extent);
  }
  const auto file_bytes = static_cast<double>(std::filesystem::file_size(from));
  if (!(bytes > 0) || bytes > kMaxPacking * file_bytes ||
      bytes > static_cast<double>(max_bytes)) {
    throw BadData(
        fmt::format("{}: variable '{}' of {} declares {:.0f} bytes; a file of {:.0f} "
                    "bytes holds at "
                    "most {:.0f}, and {} are read at most",
                    origin,
                    name,
                    array.extent,
                    bytes,
                    file_bytes,
                    kMaxPacking * file_bytes,
                    max_bytes));
  }
  CheckElementBytes(from, name);
  if (Mat_VarReadDataAll(file.get(), variable.get()) != 0 ||
      variable->data == nullptr || static_cast<double>(variable->nbytes) != bytes) {
    throw BadData(fmt::format(
        "{}: variable '{}' is truncated or damaged: get the file again", origin, name));
  }
  array.data = static_cast<const unsigned char*>(variable->data);
  array.big_endian = std::endian::native == std::endian::big;
  array.format = "mat";
  std::int64_t stride = SizeOf(*type);  // the first axis runs fastest
  for (const std::int64_t extent : array.extent) {
    array.stride_bytes.push_back(stride);
    stride *= extent;
  }
  return ImportArray(array, from, to, options, array_options, progress);
}

}  // namespace nacre::reconstruct
