#include "reconstruct/import/mat.h"

#include "reconstruct/internal/mat_variable.h"

#include <bit>

namespace nacre::reconstruct {

ImportSummary ImportMat(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ArrayImportOptions& array_options,
                        const ProgressFunction& progress,
                        std::size_t max_bytes) {
  const internal::MatVariable variable =
      internal::ReadMatVariable(from, array_options.variable, max_bytes);
  ArrayView array;
  array.type = variable.type;
  array.extent = variable.extent;
  array.data = variable.data.get();
  array.big_endian = std::endian::native == std::endian::big;
  array.format = "mat";
  auto stride = static_cast<std::int64_t>(internal::ByteSize(variable.type));
  for (const std::int64_t extent : array.extent) {
    array.stride_bytes.push_back(stride);
    stride *= extent;
  }
  return ImportArray(array, from, to, options, array_options, progress);
}

}  // namespace nacre::reconstruct
