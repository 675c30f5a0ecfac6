// Where the tests find what they read and run. The paths stand in a source that the build writes,
// so that all others compile to the same in every checkout.
#pragma once

namespace unflex::test_paths {

// Folders, without a slash at the end.
extern const char* const kData;      // tests/data
extern const char* const kExamples;  // examples
extern const char* const kDocs;      // docs

extern const char* const kProgram;    // unflex
extern const char* const kFaultShim;  // stands before the C library and has its calls fail

}  // namespace unflex::test_paths
