/// \file What this machine can do at most, and how much a particle-step asks of it: roof/fma/threads:N is fused
/// multiply-adds of whole registers that wait for nothing, roof/stream/threads:N is a = b + s c over arrays that no
/// cache holds. The machine, the compiler and the operations of a particle-step are written into the results.
#include <firn/core/parallel.hpp>

#include "flops.hpp"
#include "step.hpp"

#include <fstream>

namespace {

using Register [[gnu::vector_size(sizeof(firn::native_pack<float>))]] = float;
constexpr int lanes = sizeof(Register) / sizeof(float);

/// Twelve chains: more than the latency of an FMA times the number of units (4 × 2 today), fewer than registers. They
/// tend to 1000 start, far from numbers that a processor is slow with.
[[gnu::noinline]] Register multiply_add(long rounds, float start) {
    const Register factor = Register{} + 0.999f, term = Register{} + start;
    Register a = term, b = a + 1, c = a + 2, d = a + 3, e = a + 4, f = a + 5;
    Register g = a + 6, h = a + 7, i = a + 8, j = a + 9, k = a + 10, l = a + 11;
    for (long round = 0; round < rounds; ++round) {
        a = a * factor + term, b = b * factor + term, c = c * factor + term, d = d * factor + term;
        e = e * factor + term, f = f * factor + term, g = g * factor + term, h = h * factor + term;
        i = i * factor + term, j = j * factor + term, k = k * factor + term, l = l * factor + term;
    }
    return a + b + c + d + e + f + g + h + i + j + k + l;
}

void fma(benchmark::State& state, int threads) {
    constexpr long rounds = 1'000'000;
    scenes::Stopwatch watch;
    for (auto _ : state)
        watch.run([&] {
            firn::parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
                benchmark::DoNotOptimize(multiply_add(rounds, float(t + 1)));
            });
        });
    state.counters["flops_per_second"] =
        double(threads) * double(state.iterations()) * double(rounds) * 12 * 2 * lanes / watch.seconds();
}

void stream(benchmark::State& state, int threads) {
    constexpr std::size_t chunk = 1 << 16, chunks = 1 << 10;  // arrays of 256 MiB
    const std::unique_ptr<float[]> a(new float[chunk * chunks]), b(new float[chunk * chunks]),
        c(new float[chunk * chunks]);
    const auto for_chunks = [&](const auto& body) {
        firn::parallel_for(chunks, threads, [&](std::size_t n, int) { body(n * chunk, (n + 1) * chunk); });
    };
    for_chunks([&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) a[i] = 0, b[i] = 1, c[i] = 2;
    });
    scenes::Stopwatch watch;
    for (auto _ : state)
        watch.run([&] {
            for_chunks([&](std::size_t begin, std::size_t end) {
#pragma omp simd
                for (std::size_t i = begin; i < end; ++i) a[i] = b[i] + 3.0f * c[i];
            });
            benchmark::ClobberMemory();
        });
    state.counters["bytes_per_second"] =
        3.0 * sizeof(float) * double(chunk * chunks) * double(state.iterations()) / watch.seconds();
}

std::string processor() {
    std::ifstream cpuinfo("/proc/cpuinfo");
    for (std::string line; std::getline(cpuinfo, line);)
        if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
    return "unknown";
}

constexpr const char* compiler =
#ifdef __clang__
    __VERSION__;
#else
    "g++ " __VERSION__;
#endif

constexpr const char* vectors =
#if defined(__AVX512F__)
    "AVX-512";
#elif defined(__AVX2__)
    "AVX2";
#elif defined(__SSE2__)
        "SSE2";
#elif defined(__ARM_NEON)
        "NEON";
#else
        "unknown";
#endif

const bool registered = [] {
    benchmark::AddCustomContext("processor", processor());
    benchmark::AddCustomContext("processors", std::to_string(std::thread::hardware_concurrency()));
    benchmark::AddCustomContext("compiler", compiler);
    benchmark::AddCustomContext("vectors", vectors);
    benchmark::AddCustomContext("operations_per_particle_step",
                                std::to_string(scenes::operations_of_a_particle_step()));
    for (const int threads : scenes::thread_counts()) {
        const std::string suffix = "/threads:" + std::to_string(threads);
        benchmark::RegisterBenchmark(("roof/fma" + suffix).c_str(), [threads](benchmark::State& state) {
            fma(state, threads);
        })->Unit(benchmark::kMillisecond);
        benchmark::RegisterBenchmark(("roof/stream" + suffix).c_str(), [threads](benchmark::State& state) {
            stream(state, threads);
        })->Unit(benchmark::kMillisecond);
    }
    return true;
}();

}  // namespace
