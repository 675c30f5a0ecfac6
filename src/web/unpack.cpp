// Unpacks LZMA in the page. Browsers unpack gzip themselves, but LZMA packs the program smaller.
// This is a program of its own, with Debian's sources of LZMA, which are in the public domain.
#include <LzmaDec.h>

#include <cstdlib>

namespace {

void* give(void* /*unused*/, std::size_t bytes) { return std::malloc(bytes); }
void take_back(void* /*unused*/, void* room) { std::free(room); }

constexpr std::size_t kLengthBytes = 8;

}  // namespace

extern "C" {

[[clang::export_name("room_for")]] unsigned char* room_for(std::size_t bytes) {
  return static_cast<unsigned char*>(std::malloc(bytes));
}

// packed: a file as `xz --format=lzma` makes it, whose head tells how long it will be. Returns 1 if
// all of it was unpacked to `to`.
[[clang::export_name("unpack")]] int unpack(const unsigned char* packed, std::size_t bytes,
                                            unsigned char* to, std::size_t length) {
  constexpr std::size_t kHead = LZMA_PROPS_SIZE + kLengthBytes;
  SizeT taken = bytes - kHead;
  SizeT made = length;
  ISzAlloc memory = {give, take_back};
  ELzmaStatus status = LZMA_STATUS_NOT_SPECIFIED;
  return LzmaDecode(to, &made, packed + kHead, &taken, packed, LZMA_PROPS_SIZE, LZMA_FINISH_ANY,
                    &status, &memory) == SZ_OK &&
         made == length;
}
}
