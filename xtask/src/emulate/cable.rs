//! A cable between two serial ports of QEMU.

use std::io;
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::thread;

/// Lays a cable: waits for two connections, and passes bytes on in both directions. Returns the ports to connect
/// to.
///
/// QEMU connects before it starts the program, so that no byte is lost.
pub fn lay() -> io::Result<[u16; 2]> {
    let one = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let other = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let ports = [one.local_addr()?.port(), other.local_addr()?.port()];
    // The thread ends with QEMU or, if QEMU never connects, with this program.
    thread::spawn(move || connect(&one, &other));
    Ok(ports)
}

fn connect(one: &TcpListener, other: &TcpListener) -> io::Result<()> {
    let ((one, _), (other, _)) = (one.accept()?, other.accept()?);
    let (from_one, to_other) = (one.try_clone()?, other.try_clone()?);
    thread::spawn(move || hand_on(from_one, to_other));
    hand_on(other, one)
}

fn hand_on(mut from: TcpStream, mut to: TcpStream) -> io::Result<()> {
    to.set_nodelay(true)?;
    io::copy(&mut from, &mut to)?;
    to.shutdown(Shutdown::Write)
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    #[test]
    fn what_goes_in_at_one_end_comes_out_at_the_other() {
        let [one, other] = lay().unwrap();
        let mut one = TcpStream::connect((Ipv4Addr::LOCALHOST, one)).unwrap();
        one.write_all(b"early").unwrap();
        let mut other = TcpStream::connect((Ipv4Addr::LOCALHOST, other)).unwrap();
        other.write_all(b"back").unwrap();
        other.shutdown(Shutdown::Write).unwrap();
        one.shutdown(Shutdown::Write).unwrap();

        let read = |end: &mut TcpStream| {
            let mut text = String::new();
            end.read_to_string(&mut text).map(|_| text).unwrap()
        };
        assert_eq!((read(&mut other).as_str(), read(&mut one).as_str()), ("early", "back"));
    }
}
