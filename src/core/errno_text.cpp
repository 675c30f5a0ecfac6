#include "unflex/core/errno_text.hpp"

#include <cerrno>
#include <string_view>
#include <system_error>

namespace unflex {
namespace {

// The remedy for a file that cannot be written. Empty if none is known.
std::string_view remedy(int error) {
  switch (error) {
    case ENOSPC:
#ifdef EDQUOT  // not on Windows
    case EDQUOT:
#endif
      return "; make room there";
    case EFBIG:
      return "; raise the limit on the size of files (ulimit -f)";
    case EACCES:
    case EPERM:
    case EROFS:
      return "; choose another place or change its permissions";
    default:
      return "";
  }
}

}  // namespace

std::string errno_text(int error) { return std::generic_category().message(error); }

std::string write_error_text(int error) { return errno_text(error).append(remedy(error)); }

}  // namespace unflex
