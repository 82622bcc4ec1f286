/// \file What a program of firn's for WebAssembly gets from runtime.cpp. The same source compiles natively.
///
///     #include <firn/firn.hpp>
///     #include "runtime.hpp"
///
///     WASM_EXPORT(step) double step(int count) { … }   // in the page: module.call.step(10)
#pragma once

#include <cstddef>

/// Makes a function callable from JavaScript under the given name. Its arguments and result are numbers or pointers.
#ifdef __wasm__
#define WASM_EXPORT(name) extern "C" __attribute__((export_name(#name)))
#else
#define WASM_EXPORT(name) extern "C"
#endif

#ifdef __wasm__
namespace wasm {

/// Number of threads on which firn's loops run, including the calling one.
int threads();

/// Ends the module with a sentence, which JavaScript gets as an Error. An exception that is thrown ends the module in
/// the same way, with the sentence of its what().
[[noreturn]] void end(const char* sentence);

}  // namespace wasm
#endif
