/* A disk that is full after a number of operations: preloaded into a process, it lets those that
 * need space below the folder FULL_DISK fail with ENOSPC from then on. The number of operations
 * left lies in the file FULL_DISK_LEFT, for all processes. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static long *left;

__attribute__((constructor)) static void begin(void) {
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open64");
    const char *path = getenv("FULL_DISK_LEFT");
    int file = path ? real(path, O_RDWR) : -1;
    if (file >= 0) left = mmap(NULL, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (file >= 0) close(file);
}

static int full_at(const char *path) {
    const char *folder = getenv("FULL_DISK");
    if (!left || !folder || !path || strncmp(path, folder, strlen(folder))) return 0;
    return __atomic_fetch_sub(left, 1, __ATOMIC_SEQ_CST) <= 0;
}

static int full(int file) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t size = readlink(link, path, sizeof path - 1);
    path[size < 0 ? 0 : size] = 0;
    return full_at(path);
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define REFUSE do { errno = ENOSPC; return -1; } while (0)

ssize_t write(int file, const void *data, size_t size) {
    if (full(file)) REFUSE;
    return REAL(write)(file, data, size);
}

int open64(const char *path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    mode_t mode = va_arg(more, mode_t);
    va_end(more);
    if (flags & O_CREAT && access(path, F_OK) && full_at(path)) REFUSE;
    return REAL(open64)(path, flags, mode);
}

int posix_fallocate64(int file, off64_t begin, off64_t size) {
    return full(file) ? ENOSPC : REAL(posix_fallocate64)(file, begin, size);
}

int mkdir(const char *path, mode_t mode) {
    if (full_at(path)) REFUSE;
    return REAL(mkdir)(path, mode);
}

/* The file of rows is renamed within its folder, which needs no space; others are refused, so that
   a run ends at each step. */
int rename(const char *from, const char *to) {
    const char *name = strrchr(from, '/');
    if ((!name || strcmp(name, "/rows")) && full_at(to)) REFUSE;
    return REAL(rename)(from, to);
}

int link(const char *from, const char *to) {
    if (full_at(to)) REFUSE;
    return REAL(link)(from, to);
}
