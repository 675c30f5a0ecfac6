#include "unflex/core/rewrite_lines.hpp"

namespace unflex {

tl::unexpected<Error> output_failed(const std::string& name) {
  return fail(ErrorKind::internal, {name, 0},
              "cannot write the output; make room there, or raise the limit on the size of files "
              "(ulimit -f)");
}

Status rewrite_lines(TextStore& text, const std::string& name, const LineChange& change) {
  return text.rewrite(change) ? Status{} : output_failed(name);
}

}  // namespace unflex
