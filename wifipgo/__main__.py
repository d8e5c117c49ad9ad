"""``python -m wifipgo``: the command ``wifipgo``, for where no shell finds it."""

import sys

from wifipgo.command.own_packages import leave_out_current_folder

leave_out_current_folder()

from wifipgo.command.front import main  # noqa: E402 (what it loads is not looked for there)

if __name__ == "__main__":
    sys.exit(main())
