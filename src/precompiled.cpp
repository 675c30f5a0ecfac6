// Brings the headers that cmake/PrecompiledHeaders.cmake compiles once for all modules.
