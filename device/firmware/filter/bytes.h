/* Where a filter reads and writes: the host's standard streams, or the emulated chip's semihosting. */
#ifndef RECOIL_BYTES_H
#define RECOIL_BYTES_H

int bytes_get(void); /* -1 at the end */
void bytes_put(char byte);
_Noreturn void bytes_end(int code);

#endif
