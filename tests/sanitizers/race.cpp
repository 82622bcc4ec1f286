/// \file A data race on purpose, and its clean twin: shows that ThreadSanitizer sees what firn's threads do.
#include <firn/core/parallel.hpp>

#include <array>
#include <atomic>
#include <cstdio>
#include <string_view>

int main(int count, char** arguments) {
    const bool racing = count == 2 && std::string_view(arguments[1]) == "racing";
    constexpr int threads = 2;
    std::atomic<int> inside = 0;
    long shared = 0;
    std::array<long, threads> own{};
    // Each waits for the other, so that two threads are at work. Relaxed: this orders no other access.
    firn::parallel_for(threads, threads, [&](std::size_t i, int thread) {
        inside.fetch_add(1, std::memory_order_relaxed);
        while (inside.load(std::memory_order_relaxed) < threads) continue;
        (racing ? shared : own[std::size_t(thread)]) += long(i) + 1;
    });
    std::printf("%s: %ld\n", racing ? "racing" : "clean", shared + own[0] + own[1]);
    return 0;
}
