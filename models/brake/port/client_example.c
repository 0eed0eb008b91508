/* A controller at the port of a braked vehicle: that of example.py. Run as: client_example PORT. Frames: see frame.py.
   Build on a little-endian machine: cc -O2 -ffp-contract=off -o client_example client_example.c */
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

struct question { char magic[4]; uint32_t number; int64_t time; uint8_t wheels, flags, zero[6];
                  double supply, speed, wheel[8]; };
struct answer { char magic[4]; uint32_t number; uint8_t mode, wheels, zero[6]; double value[8]; };

int main(int count, char **words)
{
    struct sockaddr_in there = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
    struct question asked;
    struct answer given = { .magic = "TRA1", .mode = 'V' };
    double state[8] = { 1, 1, 1, 1, 1, 1, 1, 1 };
    int link = socket(AF_INET, SOCK_STREAM, 0), yes = 1;

    if (count != 2) return 2;
    there.sin_port = htons((uint16_t)atoi(words[1]));
    if (connect(link, (struct sockaddr *)&there, sizeof there)) return 1;
    setsockopt(link, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    while (recv(link, &asked, sizeof asked, MSG_WAITALL) == (ssize_t)sizeof asked) {
        for (int i = 0; i < asked.wheels && i < 8; i++) {
            double slip = 1.0 - asked.wheel[i] / (asked.speed > 0.1 ? asked.speed : 0.1);
            if (slip > 0.15) state[i] = -1;
            if (slip < 0.08) state[i] = 1;
            given.value[i] = state[i];
        }
        given.number = asked.number;
        given.wheels = asked.wheels;
        if (send(link, &given, sizeof given, 0) != (ssize_t)sizeof given) return 1;
    }
    close(link);
    return 0;
}
