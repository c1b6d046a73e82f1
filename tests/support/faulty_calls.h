#pragma once

namespace penumbra::test {

/// The calls that can be made to fail: those of write and pwrite, of fsync and fdatasync, of rename, of the allocator,
/// of accept and accept4, of open. Those of read and write that are a part do half of what they are asked.
enum class Fault { write, sync, rename, allocation, accept, open, part };

}  // namespace penumbra::test

extern "C" {
/// From now on the calls of one kind number `first` to `last`, counted from 1, fail with this errno.
void arm_fault(int kind, long first, long last, int error);
/// Nothing fails any more; returns how many calls there were.
long disarm_fault();
/// Files written to and directories that got names since faults were armed, and not fsynced since.
long unsynced_files();
}
