// PCL's library of file formats brings 67 others with it, which cost every start of the program some 20 ms and
// 26 MB. So it is loaded when a compressed PCD is met, and the program runs where it is not installed.
#include "formats/scans/lzf.h"

#include <dlfcn.h>
#include <pcl/io/lzf.h>
#include <pcl/pcl_config.h>

#include <limits>
#include <string>

#include "formats/error.h"

namespace cairn::formats {
namespace {

using Decompress = decltype(&pcl::lzfDecompress);

Decompress load_decompress(const std::string& library) {
  // pcl::lzfDecompress(void const*, unsigned, void*, unsigned)
  constexpr const char* kSymbol = "_ZN3pcl13lzfDecompressEPKvjPvj";
  void* const handle = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  return handle == nullptr ? nullptr : reinterpret_cast<Decompress>(::dlsym(handle, kSymbol));
}

}  // namespace

bool decompress_lzf(std::span<const std::byte> packed, std::span<std::byte> out) {
  static const std::string library =
      "libpcl_io.so." + std::to_string(PCL_MAJOR_VERSION) + "." + std::to_string(PCL_MINOR_VERSION);
  static const Decompress decompress = load_decompress(library);
  if (decompress == nullptr)
    throw_system("compressed PCD files need the library " + library, {}, 0);
  // PCL's loop reads a byte before it looks whether there is one.
  if (packed.empty()) return out.empty();
  CAIRN_CHECK(packed.size() <= std::numeric_limits<unsigned>::max() &&
              out.size() <= std::numeric_limits<unsigned>::max());
  return decompress(packed.data(), static_cast<unsigned>(packed.size()), out.data(),
                    static_cast<unsigned>(out.size())) == out.size();
}

}  // namespace cairn::formats
